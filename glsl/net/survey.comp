// The first row of each column of a slab that is inside; -1 if there is none.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float threshold;
    int first_slice; // stored slice of the first that is looked at
};
uniform texture3D net_values;
uniform writeonly image2D net_depths; // by column and slice
#include "net_values.glsl"

void main() {
    ivec2 to = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(to, imageSize(net_depths)))) return;
    int rows = textureSize(net_values, 0).y, found = -1;
    for (int row = 0; row < rows && found < 0; ++row) {
        if (texelFetch(net_values, ivec3(to.x, row, to.y + first_slice), 0).x >= threshold) found = row;
    }
    imageStore(net_depths, to, vec4(float(found), 0.0, 0.0, 0.0));
}
