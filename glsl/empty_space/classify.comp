// The kind of each brick, by the range of its samples: 0 active: its samples are needed; 1 empty: it is outside the insonified
// region or, for compositing, all of it is transparent; 2 homogeneous: it is inside, and its samples need not be taken, because a
// surface detector cannot fire in it, or because a mean is of zeros. Stored with a distance that the next passes reduce.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int MAX_DISTANCE = 16; // largest distance, bricks
layout(constant_id = 1) const int ENTRIES = 0;   // of the transfer function; 0: nothing is composited
layout(constant_id = 2) const int FROM_ZERO = 0; // 1: all values below the largest count, as between two samples of different bricks
layout(scalar) uniform Params {
    float window_low;
    float window_scale;
    float beyond; // ratio by which rounding may raise a sample above its largest texel: more than 1 where it is a weighted mean
    float quiet_level; // no sample of a quiet brick exceeds this
};
readonly buffer BrickTable { vec4 entry[]; } brick_table; // side: 0 outside, 1 across the border, 2 inside
readonly buffer OpaqueBefore { float entry[]; } opaque_before; // number of entries before each that are not transparent
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
    int kind;
    if (ENTRIES > 0) {
        // Every entry that a sample of the brick may use.
        int first = FROM_ZERO == 1 ? 0 : clamp(int(low * float(ENTRIES - 1)), 0, ENTRIES - 1);
        int last = clamp(int(high * float(ENTRIES - 1)) + 1, 0, ENTRIES - 1);
        kind = side == 0 || opaque_before.entry[last + 1] == opaque_before.entry[first] ? 1 : 0;
    } else {
        bool is_quiet = side == 2 && (quiet_level > 0.0 ? high <= quiet_level : windowed(range.y) == 0.0);
        kind = side == 0 ? 1 : is_quiet ? 2 : 0;
    }
    imageStore(kinds, at, vec4(float(kind * 64 + MAX_DISTANCE) / 255.0, 0.0, 0.0, 0.0));
}
