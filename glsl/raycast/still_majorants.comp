// The majorant of each brick: the largest extinction that the transfer function gives to any value that samples in it may have.
#version 460
#include "common.glsl"
layout(constant_id = 1) const int ENTRIES = 256; // of the medium
layout(scalar) uniform Params {
    float window_low;
    float window_scale;
    float beyond; // ratio by which rounding may raise a sample above its largest texel: more than 1 where it is a weighted mean
};
readonly buffer BrickTable { vec4 entry[]; } brick_table; // side: 0 outside, 1 across the border, 2 inside
readonly buffer Medium { vec4 entry[]; } medium;
uniform texture3D brick_ranges;
uniform writeonly image3D majorants;

float windowed(float value) { return clamp((value - window_low) * window_scale, 0.0, 1.0); }

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = imageSize(majorants);
    if (any(greaterThanEqual(at, size))) return;
    int side = int(brick_table.entry[(at.z * size.y + at.y) * size.x + at.x].w);
    vec2 range = texelFetch(brick_ranges, at, 0).xy;
    // Interpolated samples may lie beyond their neighbours by rounding.
    float low = windowed(range.x / beyond) - 1e-6, high = windowed(range.y * beyond) + 1e-6;
    // Every entry that a sample of the brick may use.
    int first = clamp(int(low * float(ENTRIES - 1)), 0, ENTRIES - 1);
    int last = side == 0 ? first - 1 : clamp(int(high * float(ENTRIES - 1)) + 1, 0, ENTRIES - 1);
    float largest = 0.0;
    for (int n = first; n <= last; ++n) largest = max(largest, medium.entry[n].a);
    imageStore(majorants, at, vec4(largest, 0.0, 0.0, 0.0));
}
