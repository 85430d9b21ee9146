// Light that arrives in one layer of cells across the axis that the light is nearest to, from the layer before it: shifted along the light's
// direction, spread, and absorbed, red least. The kernel of 3 x 3 has the mean and the variance that are asked for, whatever the shift, and
// no weight is negative as long as the variance lies between 1/4 and 3/4.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int AXIS = 2;  // across which layers lie
layout(constant_id = 1) const int FIRST = 0; // 1: the layer that light meets first, unspread
layout(scalar) uniform Params {
    int layer;
    vec2 shift;      // cells along the other two axes from a place to where its light comes from
    float variance;  // cells^2
    vec3 absorption; // of red, green and blue over the path through one layer of density 1
};
uniform texture3D matter;
uniform texture2D front;
uniform writeonly image2D next_front;
uniform writeonly image3D arriving;

vec3 weights_of(float shift) {
    float spread = variance + shift * shift;
    return vec3(0.5 * (spread - shift), 1.0 - spread, 0.5 * (spread + shift));
}

void main() {
    ivec2 at = ivec2(gl_GlobalInvocationID.xy), size = imageSize(next_front);
    if (any(greaterThanEqual(at, size))) return;
    ivec3 cell = AXIS == 0 ? ivec3(layer, at) : AXIS == 1 ? ivec3(at.x, layer, at.y) : ivec3(at, layer);
    vec3 light = vec3(1.0);
    if (FIRST == 0) {
        vec2 whole = floor(shift + 0.5);
        vec3 across = weights_of(shift.x - whole.x), down = weights_of(shift.y - whole.y);
        ivec2 from = at + ivec2(whole);
        light = vec3(0.0);
        for (int y = 0; y < 3; ++y) {
            for (int x = 0; x < 3; ++x) {
                ivec2 tap = clamp(from + ivec2(x, y) - 1, ivec2(0), size - 1);
                light += across[x] * down[y] * texelFetch(front, tap, 0).rgb;
            }
        }
    }
    // The density goes with the light: the passes that scatter it weigh by it.
    float density = texelFetch(matter, cell, 0).x;
    vec3 half_way = exp(-0.5 * density * absorption);
    light *= half_way;
    imageStore(arriving, cell, vec4(light, density));
    imageStore(next_front, at, vec4(light * half_way, 1.0));
}
