// Emission and absorption, front to back (thesis 4-1, 4-2): what one step adds to a ray.
layout(constant_id = 26) const int EARLY_END = 1;
layout(constant_id = 27) const int COMPOSITING = 1; // 0 a = y, 1 a = 1 - exp(-y), 2 the same between two samples,
                                            // 3 light and opacity of the step between two samples
layout(constant_id = 28) const int DEPTH_CODED = 0; // 1: colours go from near to far tint
layout(constant_id = 29) const int ENTRIES = 256;   // of the transfer table, along each side

// Colour and absorption over the sample value; pre-integrated: their mean between two values, one row per front value;
// exponential: premultiplied colour and opacity of a complete step between them, then colour and absorption over the value.
readonly buffer TransferTable { vec4 entry[]; } transfer;

// 1 - exp(-y) without losing a small y: seven terms of the Taylor series below one half.
float opacity_of(float y) {
    float series = y * (1.0 - y / 2.0 * (1.0 - y / 3.0 * (1.0 - y / 4.0 * (1.0 - y / 5.0 * (1.0 - y / 6.0 * (1.0 - y / 7.0))))));
    return y < 0.5 ? series : 1.0 - exp(-y);
}

vec4 looked_up(float value) {
    float e = value * float(ENTRIES - 1);
    int n = min(int(e), ENTRIES - 2);
    return mix(transfer.entry[n], transfer.entry[n + 1], e - float(n));
}

// Distance from the ray's entry to the middle of step i, which has this length. A complete step has the sample of the surface
// detector there, to the last bit.
float middle_of(Ray ray, int i, float length, bool complete) {
    precise float middle = offset_of(ray, float(i)) + 0.5 * length;
    return SPREAD == 0 && complete ? offset_of(ray, float(i) + 0.5) : middle;
}

#include "region_fade.glsl"
#include "lit.glsl"

// Opacity of a step of this length, with the absorption at place p.
float step_opacity(vec4 entry, float length, vec3 p) {
    float y = entry.a * faded(p) * absorption_scale * (length / step_length);
    return COMPOSITING == 3 ? entry.a : COMPOSITING == 0 ? min(y, 1.0) : opacity_of(y);
}

// Adds a step of this opacity, with the colour at place p under the light that was looked up, to the light of a ray.
void add_step(vec4 entry, float a, vec3 p, inout vec3 colour, inout float opacity) {
    // The exponential rule's colour is premultiplied.
    float emitted = COMPOSITING == 3 ? 1.0 : a;
    if (LIT == 1) entry.rgb = entry.rgb * scattered + highlight * light_colour;
    if (DEPTH_CODED == 1) entry.rgb *= mix(near_tint, far_tint, clamp(dot(p, depth_axis) - depth_near, 0.0, 1.0));
    colour += (1.0 - opacity) * emitted * entry.rgb;
    opacity += (1.0 - opacity) * a;
}
