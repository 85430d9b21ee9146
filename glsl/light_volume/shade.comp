// The light that leaves each cell by scattering, and its orientation: what does not depend on the view. `relief` is how much the light depends
// on the orientation.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    vec3 towards; // unit direction to the light
    float diffuse;
    vec3 light_colour;
    vec3 wrap;
    float relief;
    float cell; // mm
    float slope; // of the echo at which an orientation is certain, 1/mm
};
uniform texture3D matter;
uniform texture3D pyramid_1;
uniform texture3D arriving;
uniform texture3D ambient_light;
uniform writeonly image3D light_shade;
uniform writeonly image3D light_normals;
#include "light_lattice.glsl"

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), last = imageSize(light_shade) - 1;
    if (any(greaterThan(at, last))) return;
    vec4 shade = vec4(0.0), oriented = vec4(0.0);
    if (texelFetch(pyramid_1, at / 2, 0).x > 0.0) {
        // Differences weighted by (1, 2, 1) along the other axes.
        vec3 gradient = vec3(0.0);
        for (int n = 0; n < 27; ++n) {
            ivec3 away = ivec3(n % 3, (n / 3) % 3, n / 9) - 1;
            float echo = texelFetch(matter, clamp(at + away, ivec3(0), last), 0).y;
            vec3 weight = vec3(2 - abs(away));
            gradient += echo * vec3(away) * vec3(weight.y * weight.z, weight.x * weight.z, weight.x * weight.y);
        }
        gradient /= 32.0 * cell;
        float steep = length(gradient);
        vec3 normal = steep > 1e-9 * slope ? -gradient / steep : vec3(0.0);
        float certain = min(steep / slope, 1.0);
        vec3 wrapped = max((vec3(dot(normal, towards)) + wrap) / (1.0 + wrap), vec3(0.0));
        vec3 key = texelFetch(arriving, at, 0).rgb * light_colour;
        vec4 ambient;
        BETWEEN_CELLS(ambient_light, (vec3(at) + 0.5) / 2.0, ambient)
        // A sphere under light from all sides sees 1 / 1.6 of what faces the light does.
        shade = vec4(diffuse * key * (1.0 + certain * relief * (1.6 * wrapped - 1.0)) + light_colour * ambient.rgb, ambient.a);
        oriented = vec4(certain * normal, key.g);
    }
    imageStore(light_shade, at, shade);
    imageStore(light_normals, at, oriented);
}
