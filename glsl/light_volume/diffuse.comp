// Light that tissue scatters on: along one axis a Gaussian for each colour, weighted by the density of the matter, so that fluid passes nothing
// on. Where no matter is near, light stays as it is.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int AXIS = 0;
layout(constant_id = 1) const int RADIUS = 4;
layout(scalar) uniform Params {
    vec3 narrowness; // 1 / (2 sigma^2) of red, green and blue, 1/cells^2
};
const float FLUID = 0.0015; // density that fluid counts as: its cells take on the light of the tissue beside them
uniform texture3D pyramid_1;
uniform texture3D source; // light and density
uniform writeonly image3D target;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = imageSize(target);
    if (any(greaterThanEqual(at, size))) return;
    vec4 light = texelFetch(source, at, 0);
    // A cell of the pyramid holds what is in 4 x 4 x 4 cells, these 2 x 2 x 2 in their middle.
    if (texelFetch(pyramid_1, at / 2, 0).x > 0.0) {
        vec3 weight = vec3(light.a + FLUID), sum = weight * light.rgb;
        // exp(-i^2 narrowness) by products: each ratio of neighbours is the one before it times a constant.
        vec3 ratio = exp(-narrowness), share = vec3(1.0), decline = ratio * ratio;
        for (int i = 1; i <= RADIUS; ++i) {
            share *= ratio;
            ratio *= decline;
            for (int side = -1; side <= 1; side += 2) {
                ivec3 tap = at;
                tap[AXIS] += side * i;
                if (tap[AXIS] < 0 || tap[AXIS] >= size[AXIS]) continue;
                vec4 there = texelFetch(source, tap, 0);
                vec3 w = share * (there.a + FLUID);
                sum += w * there.rgb;
                weight += w;
            }
        }
        light.rgb = sum / weight;
    }
    imageStore(target, at, light);
}
