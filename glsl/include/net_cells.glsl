// The crossed cells of a lattice, row by row: an invocation goes along a row of cells. So they have an order without atomic operations, and
// the voxels between two cells are read once.

layout(constant_id = 0) const int CLOSED = 1; // 1: what is not known is outside, and voxels before and behind the lattice are not known
layout(scalar) uniform Params {
    float threshold;
    int layer;       // the first of this dispatch
    int layers;      // the one behind its last
    int first_layer; // the slice before layer 0; negative: not known
};
uniform texture3D net_values;

#include "net_values.glsl"

struct Row {
    ivec3 first; // voxel
    int cells;
};

// The row of cells of a layer of the slab.
Row row_at(int row, int layer) {
    return Row(ivec3(-CLOSED, row - CLOSED, layer + first_layer), textureSize(net_values, 0).x + 2 * CLOSED - 1);
}

// Of the four corners of cells at a voxel, one row and one slice on: the corners inside in bits 0, 2, 4, 6, those not known in 8 bits more.
uint corners_at(ivec3 at) {
    uint bits = 0u;
    ivec3 size = textureSize(net_values, 0);
    for (int n = 0; n < 4; ++n) {
        ivec3 there = at + ivec3(0, n & 1, n >> 1);
        float value = UNKNOWN;
        if (all(greaterThanEqual(there, ivec3(0))) && all(lessThan(there, size))) value = texelFetch(net_values, there, 0).x;
        if (value >= threshold) bits |= 1u << (2 * n);
        if (!is_known(value)) bits |= 256u << (2 * n);
    }
    return bits;
}

bool is_crossed(uint corners) {
    uint inside = corners & 255u;
    return inside != 0u && inside != 255u;
}
