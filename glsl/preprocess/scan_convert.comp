// One polar frame into one slice: the look-up table says between which samples and lines a pixel lies; pixels outside the
// sector are left out (thesis Fig. 31).
// variants: plane; slice SLICE
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float gain; // stored value to 0..1
    float offset;
    int slice;
};
uniform texture2D frames; // one layer of the frame array
uniform texture2D scan_lut;
#include "slice_target.glsl"

float sample_at(ivec2 at) { return texelFetch(frames, at, 0).x; }

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, textureSize(scan_lut, 0)))) return;
    vec2 index = texelFetch(scan_lut, at, 0).xy;
    if (index.x < 0.0) return; // the inside flag
    ivec2 base = min(ivec2(index), textureSize(frames, 0) - 2);
    vec2 share = index - vec2(base);
    float near = mix(sample_at(base), sample_at(base + ivec2(1, 0)), share.x);
    float far = mix(sample_at(base + ivec2(0, 1)), sample_at(base + ivec2(1, 1)), share.x);
    write_slice(at, clamp(mix(near, far, share.y) * gain + offset, 0.0, 1.0));
}
