// What each brick is to a mode, by the range of its samples: 0 its samples are wanted; 1 nothing in it is: it lies outside the
// insonified region or, in a volume, all of it is transparent; 2 it lies inside, and what it holds is known without looking:
// a surface detector cannot fire in it, or a mean is of zeros. Written with a distance that the next passes bring down.
// variants: plain; transparent TRANSPARENT
#version 460
#include "common.glsl"
layout(constant_id = 0) const int FARTHEST = 16; // bricks that a distance goes up to
#ifdef TRANSPARENT
layout(constant_id = 1) const int FROM_ZERO = 0; // 1: all values below the largest count, as between two samples of different bricks
layout(constant_id = 2) const int ENTRIES = 256;
#endif
layout(scalar) uniform Params {
    float window_low;
    float window_scale;
    float beyond; // how many times its largest texel a sample may be, by rounding: more than 1 where it is a weighted mean
#ifndef TRANSPARENT
    float quiet; // what no sample of a quiet brick exceeds
#endif
};
readonly buffer BrickTable { vec4 entry[]; } brick_table; // side: 0 outside, 1 across the border, 2 inside
#ifdef TRANSPARENT
readonly buffer OpaqueBefore { float entry[]; } opaque_before; // entries of the transfer function that are not transparent, before each
#endif
uniform texture3D brick_ranges;
uniform writeonly image3D kinds;

float windowed(float value) { return clamp((value - window_low) * window_scale, 0.0, 1.0); }

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = imageSize(kinds);
    if (any(greaterThanEqual(at, size))) return;
    int side = int(brick_table.entry[(at.z * size.y + at.y) * size.x + at.x].w);
    vec2 range = texelFetch(brick_ranges, at, 0).xy;
    range = vec2(range.x / beyond, range.y * beyond);
    // Interpolated samples may lie beyond their neighbours by rounding.
    float low = windowed(range.x) - 1e-6, high = windowed(range.y) + 1e-6;
#ifdef TRANSPARENT
    // Every entry that a sample of the brick looks at.
    int first = FROM_ZERO == 1 ? 0 : clamp(int(low * float(ENTRIES - 1)), 0, ENTRIES - 1);
    int last = clamp(int(high * float(ENTRIES - 1)) + 1, 0, ENTRIES - 1);
    int kind = side == 0 || opaque_before.entry[last + 1] == opaque_before.entry[first] ? 1 : 0;
#else
    bool silent = side == 2 && (quiet > 0.0 ? high <= quiet : windowed(range.y) == 0.0);
    int kind = side == 0 ? 1 : silent ? 2 : 0;
#endif
    imageStore(kinds, at, vec4(float(kind * 64 + FARTHEST) / 255.0, 0.0, 0.0, 0.0));
}
