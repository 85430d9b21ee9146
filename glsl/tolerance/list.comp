// The marked pixels in order: how many are in the tiles before each, and how many workgroups take them all. One workgroup, each invocation of which counts
// as many tiles in a row.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    int tile_columns;
    int tile_rows;
};
uniform utexture2D error_marks;
uniform writeonly uimage2D marked_before;
uniform writeonly uimage2D refine_groups;
shared uint counts[64];
const uint WIDEST = 32768u; // workgroups along x: fewer than any device allows

ivec2 tile_at(uint n) { return ivec2(n % uint(tile_columns), n / uint(tile_columns)); }
uint count_in(uint n) {
    uvec2 marks = texelFetch(error_marks, tile_at(n), 0).xy;
    return uint(bitCount(marks.x) + bitCount(marks.y));
}

void main() {
    uint own = gl_LocalInvocationIndex, tiles = uint(tile_columns * tile_rows), each = (tiles + 63u) / 64u;
    uint first = min(own * each, tiles), end = min(first + each, tiles), count = 0u;
    for (uint n = first; n < end; ++n) count += count_in(n);
    counts[own] = count;
    barrier();
    uint before = 0u;
    for (uint n = 0u; n < own; ++n) before += counts[n];
    for (uint n = first; n < end; ++n) {
        imageStore(marked_before, tile_at(n), uvec4(before, 0u, 0u, 0u));
        before += count_in(n);
    }
    if (own == 63u) {
        uint groups = (before + 63u) / 64u, wide = clamp(groups, 1u, WIDEST);
        imageStore(refine_groups, ivec2(0, 0), uvec4(wide, 0u, 0u, 0u));
        imageStore(refine_groups, ivec2(1, 0), uvec4((groups + wide - 1u) / wide, 0u, 0u, 0u));
        imageStore(refine_groups, ivec2(2, 0), uvec4(1u, 0u, 0u, 0u));
        imageStore(refine_groups, ivec2(3, 0), uvec4(before, 0u, 0u, 0u));
    }
}
