// A list of the crossed cells of some layers of a slab, in the order of layers, rows and columns: where each row begins is known from the
// counts.
#version 460
#include "common.glsl"
#include "net_cells.glsl"
uniform utexture2D net_counts;
uniform utexture2D net_firsts; // by row and layer: where its cells begin in the list
uniform writeonly uimage2D net_crossed;

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, layer);
    if (any(greaterThanEqual(at, ivec2(textureSize(net_counts, 0).x, layers)))) return;
    uint left = texelFetch(net_counts, at, 0).x;
    if (left == 0u) return;
    uint next = texelFetch(net_firsts, at, 0).x;
    uint width = uint(imageSize(net_crossed).x);
    Row row = row_at(at.x, at.y);
    uint low = corners_at(row.first);
    for (int n = 0; n < row.cells && left > 0u; ++n) {
        uint high = corners_at(row.first + ivec3(n + 1, 0, 0));
        uint corners = low | high << 1;
        if (is_crossed(corners)) {
            // Of the corners not known, a bit for each, only whether there is one counts.
            uint known = CLOSED == 1 || corners < 256u ? 1u << 24 : 0u;
            uvec2 cell = uvec2(uint(n) | (corners & 255u) << 16 | known, uint(at.x) | uint(at.y) << 16);
            imageStore(net_crossed, ivec2(next % width, next / width), uvec4(cell, 0u, 0u));
            ++next;
            --left;
        }
        low = high;
    }
}
