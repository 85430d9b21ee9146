// Light that arrives in one layer of cells, from the layer before it.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    int layer;
#include "propagation_params.glsl"
};
#include "propagation.glsl"

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(next_front);
    if (any(greaterThanEqual(at, size))) return;
    ivec3 cell = cell_of(layer, at);
    vec3 light = vec3(1.0);
    if (FIRST == 0) {
        vec2 whole = floor(shift + 0.5);
        vec3 across = weights_of(shift.x - whole.x), down = weights_of(shift.y - whole.y);
        ivec2 from = at + ivec2(whole);
        light = vec3(0.0);
        for (int y = 0; y < 3; ++y) {
            for (int x = 0; x < 3; ++x) {
                ivec2 tap = clamp(from + STRIDE * (ivec2(x, y) - 1), ivec2(0), size - 1);
                light += across[x] * down[y] * texelFetch(front, tap, 0).rgb;
            }
        }
    }
    // The density goes with the light: the passes that scatter it weigh by it.
    float density = texelFetch(matter, cell, 0).x;
    vec3 absorbed = half_way(density);
    light *= absorbed;
    imageStore(arriving, cell, vec4(light, density));
    imageStore(next_front, at, vec4(light * absorbed, 1.0));
}
