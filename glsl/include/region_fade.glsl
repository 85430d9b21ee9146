// Matter fades towards the faces of the region, except the one that is nearest to the probe: what the region cuts has no hard edge.
layout(constant_id = 33) const int FADE = 0; // 1: it does
float faded(vec3 p) {
    if (FADE == 0) return 1.0;
    vec3 low = p - box_low, high = box_high - p;
    // How far beyond the beginning of the fade it lies, as a share of the fade's length; edges and corners are round.
    vec3 beyond = max(1.0 - fade_density * vec3(min(low.x, high.x), high.y, min(low.z, high.z)), vec3(0.0));
    return smoothstep(0.0, 1.0, 1.0 - length(beyond));
}
