// The number of crossed cells in each row of cells of a slab.
#version 460
#include "common.glsl"
#include "net_cells.glsl"
uniform writeonly uimage2D net_counts; // by row and layer

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, layer);
    if (any(greaterThanEqual(at, ivec2(imageSize(net_counts).x, layers)))) return;
    Row row = row_at(at.x, at.y);
    uint low = corners_at(row.first), count = 0u;
    for (int n = 0; n < row.cells; ++n) {
        uint high = corners_at(row.first + ivec3(n + 1, 0, 0));
        if (is_crossed(low | high << 1)) ++count;
        low = high;
    }
    imageStore(net_counts, at, uvec4(count, 0u, 0u, 0u));
}
