// Where vertices are: the mean of the points at which the surface crosses some edges of a cell, from the cell's first corner, voxels.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int CLOSED = 1;
layout(scalar) uniform Params {
    float threshold;
    int first_layer;
    int rows; // of the list that are filled
};
uniform texture3D net_values;
uniform utexture2D net_asked; // cells, and a bit for each of their edges
uniform writeonly image2D net_offsets;
#include "net_values.glsl"

float value_at(ivec3 at) {
    if (any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, textureSize(net_values, 0)))) return UNKNOWN;
    return texelFetch(net_values, at, 0).x;
}

// Share of the way from one value to another at which the surface is.
float crossing(float a, float b) {
    // Of the unknown nothing is known but that the border is between.
    if (!is_known(a) || !is_known(b)) return 0.5;
    return a == b ? 0.5 : clamp((threshold - a) / (b - a), 0.0, 1.0);
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(at, ivec2(imageSize(net_offsets).x, rows)))) return;
    uvec2 asked = texelFetch(net_asked, at, 0).xy;
    ivec3 cell = ivec3(asked.x & 65535u, asked.y & 65535u, asked.y >> 16) + ivec3(-CLOSED, -CLOSED, first_layer);
    vec3 sum = vec3(0.0);
    float count = 0.0;
    // Edge 4 a + n runs along axis a; bit 0 of n is its place along axis a + 1 (mod 3), bit 1 along axis a + 2.
    for (int edge = 0; edge < 12; ++edge) {
        int axis = edge / 4;
        ivec3 low = ivec3(0);
        low[(axis + 1) % 3] = edge & 1;
        low[(axis + 2) % 3] = edge >> 1 & 1;
        ivec3 high = low;
        high[axis] = 1;
        float share = crossing(value_at(cell + low), value_at(cell + high));
        if ((asked.x >> (16 + edge) & 1u) == 1u) {
            sum += mix(vec3(low), vec3(high), share);
            count += 1.0;
        }
    }
    imageStore(net_offsets, at, vec4(sum / max(count, 1.0), 0.0));
}
