// The next level of a Gaussian pyramid of the matter: half as many cells along each axis, by (1, 3, 3, 1) / 8 along each.
#version 460
#include "common.glsl"
uniform texture3D source;
uniform writeonly image3D target;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = textureSize(source, 0);
    if (any(greaterThanEqual(at, imageSize(target)))) return;
    float sum = 0.0;
    for (int z = -1; z <= 2; ++z) {
        for (int y = -1; y <= 2; ++y) {
            for (int x = -1; x <= 2; ++x) {
                ivec3 from = clamp(2 * at + ivec3(x, y, z), ivec3(0), size - 1);
                float weight = (x == 0 || x == 1 ? 3.0 : 1.0) * (y == 0 || y == 1 ? 3.0 : 1.0) * (z == 0 || z == 1 ? 3.0 : 1.0);
                sum += weight * texelFetch(source, from, 0).x;
            }
        }
    }
    imageStore(target, at, vec4(sum / 512.0, 0.0, 0.0, 0.0));
}
