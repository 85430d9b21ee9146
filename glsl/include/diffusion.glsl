// Conductance between a texel and its neighbour, from their difference. Colours share one conductance, from the root mean square
// of their three differences (Gerig et al. 1992), which for a grey is the grey's difference.
#include "conductance.glsl"
float across(T away) {
#ifdef PICTURE
    float g = length(away.rgb) * 0.57735027;
#else
    float g = away;
#endif
    return CONDUCTANCE == 0 ? quotient(g, edge) : exponential(g, edge);
}
