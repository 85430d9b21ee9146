// Fills each column of a slab from its first row inside on, down to the last row of the result.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float threshold;
};
uniform texture3D source;
uniform writeonly image3D net_filled;
#include "net_values.glsl"

void main() {
    ivec2 column = ivec2(gl_GlobalInvocationID.xy); // column, slice
    ivec3 size = imageSize(net_filled);
    if (any(greaterThanEqual(column, size.xz))) return;
    int rows = textureSize(source, 0).y;
    float filled = UNKNOWN;
    for (int row = 0; row < size.y; ++row) {
        float value = row < rows ? texelFetch(source, ivec3(column.x, row, column.y), 0).x : UNKNOWN;
        // Unknown values leave what is filled as it is.
        filled = filled >= threshold ? max(filled, value) : value;
        imageStore(net_filled, ivec3(column.x, row, column.y), vec4(filled, 0.0, 0.0, 0.0));
    }
}
