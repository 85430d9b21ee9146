    float threshold;
    float rough_threshold;
    float polarity; // +1 bright tissue in dark fluid, -1 a dark cavity, 0 both
    float noise;    // an edge must exceed this many standard deviations of the noise
    float quiet_level;  // samples that do not exceed this cannot fire the detector
    float behind_step;  // distance of the samples behind the surface, mm
