// The smallest and the largest value that samples in each brick may have, for bricks that depend on an updated slice. A brick
// outside the insonified region has no samples: its smallest value is larger than its largest.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    int slice;  // the first updated slice
    int slices;
};
readonly buffer BrickTable { vec4 entry[]; } brick_table; // tile columns, tile rows, slices (first * 4096 + last), side
uniform texture3D tile_ranges;
uniform writeonly image3D brick_ranges;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = imageSize(brick_ranges);
    if (any(greaterThanEqual(at, size))) return;
    vec4 entry = brick_table.entry[(at.z * size.y + at.y) * size.x + at.x];
    ivec3 ends = ivec3(entry.xyz);
    ivec3 first = ends >> 12, last = ends & 4095;
    if (last.z < slice || first.z >= slice + slices) return;
    float low = 1.0, high = 0.0;
    // No tile outside.
    if (entry.w == 0.0) last = first - 1;
    // No counter that is divided by the extent: a CPU divides integers lane by lane.
    for (int z = first.z; z <= last.z; ++z) {
        for (int y = first.y; y <= last.y; ++y) {
            for (int x = first.x; x <= last.x; ++x) {
                vec2 range = texelFetch(tile_ranges, ivec3(x, y, z), 0).xy;
                low = min(low, range.x);
                high = max(high, range.y);
            }
        }
    }
    imageStore(brick_ranges, at, vec4(low, high, 0.0, 0.0));
}
