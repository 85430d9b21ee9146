// Light from everywhere above: seven cones towards the probe, each through four places whose width grows with the distance: that of the cells of a
// level of the pyramid, or between two levels, whatever the size of the lattice's cells. With it the back light, which has its own propagation. Red,
// green, blue, and the ambient share alone.
#version 460
#extension GL_EXT_control_flow_attributes : require
#include "common.glsl"
layout(constant_id = 0) const int BACK = 0; // 1: there is a back light
layout(constant_id = 1) const int NARROWEST = 0; // level, from 0, of the first place; one below 0 has cells that are narrower than there are
layout(constant_id = 2) const int BETWEEN = 0; // 1: places are wider than the cells of that level, and narrower than those of the next
layout(scalar) uniform Params {
    float absorption; // in matter of density 1, per unit of length: a 20th of the reach of the cones
    float density;    // cells of this lattice per unit of length
    vec3 powers;      // of the share that arrives, for red, green and blue
    float ambient;
    vec3 back_colour; // times its strength
    float wider;      // share of the next level
};
uniform texture3D around; // whether matter is near
// Of NARROWEST and the levels behind it, the first one in place of any before it.
uniform texture3D pyramid_1;
uniform texture3D pyramid_2;
uniform texture3D pyramid_3;
uniform texture3D pyramid_4;
uniform texture3D pyramid_5;
uniform texture3D back_light;
uniform writeonly image3D ambient_light;
#include "light_lattice.glsl"

const float REACH[4] = float[](2.5, 5.0, 10.0, 20.0); // units of length along a cone
const float LENGTH[4] = float[](2.5, 3.5, 7.0, 12.0); // of the part that each stands for

// Cells of the ambient light's lattice, which are those of level 0, in one of a level.
float cells_of(int level) { return float(1 << max(NARROWEST + level, 0)); }
const vec3 CONES[7] = vec3[](vec3(0.0, -1.0, 0.0), vec3(0.8, -0.6, 0.0), vec3(0.4, -0.6, 0.69282032), vec3(-0.4, -0.6, 0.69282032),
                             vec3(-0.8, -0.6, 0.0), vec3(-0.4, -0.6, -0.69282032), vec3(0.4, -0.6, -0.69282032));

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = imageSize(ambient_light);
    if (any(greaterThanEqual(at, size))) return;
    float open = 1.0;
    // Where no matter is near nothing is lit.
    if (texelFetch(around, min(at / 2, textureSize(around, 0) - 1), 0).x > 0.0) {
        open = 0.0;
        // One cone at a time: with the texels of all of them on the way at once a processor holds less than half of its threads.
        [[dont_unroll]] for (int n = 0; n < 7; ++n) {
            float matter = 0.0;
            for (int level = 0; level < 4; ++level) {
                vec3 place = vec3(at) + 0.5 + CONES[n] * REACH[level] * density;
                vec4 found;
                if (level == 0) BETWEEN_CELLS(pyramid_1, place / cells_of(0), found)
                else if (level == 1) BETWEEN_CELLS(pyramid_2, place / cells_of(1), found)
                else if (level == 2) BETWEEN_CELLS(pyramid_3, place / cells_of(2), found)
                else BETWEEN_CELLS(pyramid_4, place / cells_of(3), found)
                if (BETWEEN == 1 && NARROWEST + level >= 0) {
                    vec4 beyond;
                    if (level == 0) BETWEEN_CELLS(pyramid_2, place / cells_of(1), beyond)
                    else if (level == 1) BETWEEN_CELLS(pyramid_3, place / cells_of(2), beyond)
                    else if (level == 2) BETWEEN_CELLS(pyramid_4, place / cells_of(3), beyond)
                    else BETWEEN_CELLS(pyramid_5, place / cells_of(4), beyond)
                    found.x = mix(found.x, beyond.x, wider);
                }
                matter += found.x * LENGTH[level];
            }
            open += exp(-absorption * matter) / 7.0;
        }
    }
    vec3 light = ambient * pow(vec3(max(open, 1e-6)), powers);
    if (BACK == 1) light += back_colour * texelFetch(back_light, at, 0).rgb;
    imageStore(ambient_light, at, vec4(light, ambient * open));
}
