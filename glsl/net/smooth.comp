// A Gaussian over a slab of a lattice, along one axis: the mean of the known values around each. What is not known stays so.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int AXIS = 0;
layout(scalar) uniform Params {
    int reach;         // voxels
    float narrowness;  // 0.5 / standard deviation^2, 1/voxels^2
    int first_slice;   // of this dispatch
};
uniform texture3D source;
uniform writeonly image3D target;
#include "net_values.glsl"

void main() {
    ivec3 to = ivec3(gl_GlobalInvocationID) + ivec3(0, 0, first_slice);
    ivec3 size = textureSize(source, 0);
    if (any(greaterThanEqual(to, size))) return;
    float value = texelFetch(source, to, 0).x;
    if (is_known(value)) {
        float sum = 0.0, weights = 0.0;
        int low = max(-reach, -to[AXIS]), high = min(reach, size[AXIS] - 1 - to[AXIS]);
        for (int n = low; n <= high; ++n) {
            ivec3 at = to;
            at[AXIS] += n;
            float there = texelFetch(source, at, 0).x;
            float weight = is_known(there) ? exp(-narrowness * float(n * n)) : 0.0;
            sum += weight * (is_known(there) ? there : 0.0);
            weights += weight;
        }
        value = sum / weights;
    }
    imageStore(target, to, vec4(value, 0.0, 0.0, 0.0));
}
