// Light from everywhere above: seven cones towards the probe, each through four levels of the pyramid, whose cells widen with the distance.
// With it the back light, which has its own propagation. Red, green, blue, and the ambient share alone.
#version 460
#extension GL_EXT_control_flow_attributes : require
#include "common.glsl"
layout(constant_id = 0) const int BACK = 0; // 1: there is a back light
layout(scalar) uniform Params {
    float absorption; // 1/mm in matter of density 1
    float density;    // cells of this lattice per mm
    vec3 powers;      // of the share that arrives, for red, green and blue
    float ambient;
    vec3 back_colour; // times its strength
};
uniform texture3D pyramid_1;
uniform texture3D pyramid_2;
uniform texture3D pyramid_3;
uniform texture3D pyramid_4;
uniform texture3D back_light;
uniform writeonly image3D ambient_light;
#include "light_lattice.glsl"

const float REACH[4] = float[](2.5, 5.0, 10.0, 20.0); // mm along a cone
const float LENGTH[4] = float[](2.5, 3.5, 7.0, 12.0); // of the part that each stands for, mm
const vec3 CONES[7] = vec3[](vec3(0.0, -1.0, 0.0), vec3(0.8, -0.6, 0.0), vec3(0.4, -0.6, 0.69282032), vec3(-0.4, -0.6, 0.69282032),
                             vec3(-0.8, -0.6, 0.0), vec3(-0.4, -0.6, -0.69282032), vec3(0.4, -0.6, -0.69282032));

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = imageSize(ambient_light);
    if (any(greaterThanEqual(at, size))) return;
    float open = 1.0;
    // Where no matter is near nothing is lit.
    if (texelFetch(pyramid_2, min(at / 2, textureSize(pyramid_2, 0) - 1), 0).x > 0.0) {
        open = 0.0;
        // One cone at a time: with the texels of all of them on the way at once a processor holds less than half of its threads.
        [[dont_unroll]] for (int n = 0; n < 7; ++n) {
            float matter = 0.0;
            for (int level = 0; level < 4; ++level) {
                vec3 place = vec3(at) + 0.5 + CONES[n] * REACH[level] * density;
                vec4 found;
                if (level == 0) BETWEEN_CELLS(pyramid_1, place, found)
                else if (level == 1) BETWEEN_CELLS(pyramid_2, place / 2.0, found)
                else if (level == 2) BETWEEN_CELLS(pyramid_3, place / 4.0, found)
                else BETWEEN_CELLS(pyramid_4, place / 8.0, found)
                matter += found.x * LENGTH[level];
            }
            open += exp(-absorption * matter) / 7.0;
        }
    }
    vec3 light = ambient * pow(vec3(max(open, 1e-6)), powers);
    if (BACK == 1) light += back_colour * texelFetch(back_light, at, 0).rgb;
    imageStore(ambient_light, at, vec4(light, ambient * open));
}
