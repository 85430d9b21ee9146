// Light of the light volume on matter: what its cells scatter, a sheen towards the silhouette, and a highlight.
const float SHEEN = 0.3;
layout(constant_id = 34) const int LIT = 0; // 1: the light volume lights what is composited
layout(constant_id = 45) const int LIT_STEPS = 1; // steps of a ray that share the light in their middle
uniform sampler3D light_shade;   // light that is scattered, and its ambient share
uniform sampler3D light_normals; // orientation, as long as it is certain; light for the highlight
#include "light_lattice.glsl"
#include "film.glsl"

// Of the last look-up: its steps, what the colour of matter is multiplied by, and the share of the light's own colour that is added.
int lit_steps = -1;
vec3 scattered = vec3(0.0);
float highlight = 0.0;

void look_up_light(vec3 p, vec3 along) {
    vec3 at = (p - light_low) * light_density;
    vec4 shade, oriented;
    if (SAMPLING == 0) {
        vec3 place = at / vec3(textureSize(light_shade, 0));
        shade = textureLod(light_shade, place, 0.0);
        oriented = textureLod(light_normals, place, 0.0);
    } else {
        BETWEEN_CELLS(light_shade, at, shade)
        BETWEEN_CELLS(light_normals, at, oriented)
    }
    float certain = length(oriented.xyz);
    scattered = shade.rgb;
    highlight = 0.0;
    if (certain < 1e-4) return;
    vec3 normal = oriented.xyz / certain;
    vec3 halfway = light_towards - along;
    float half_length = length(halfway);
    float gloss = half_length > 1e-6 && dot(normal, light_towards) > 0.0 ? clamp(dot(normal, halfway) / half_length, 0.0, 1.0) : 0.0;
    float shine = shininess == 0.0 ? 1.0 : (gloss > 0.0 ? min(pow(gloss, shininess), 1.0) : 0.0);
    float grazing = 1.0 - max(-dot(normal, along), 0.0);
    scattered += shade.a * SHEEN * grazing * grazing * grazing;
    highlight = specular * shine * certain * oriented.w;
}

// Looks up the light of step i, whose sample is at p, unless a step that shares it has done so.
void light_step(Ray ray, int i, vec3 p) {
    int steps = i / LIT_STEPS;
    if (LIT_STEPS == 1 || steps != lit_steps) {
        lit_steps = steps;
        vec3 middle = place_at(ray, offset_of(ray, float(steps * LIT_STEPS) + 0.5 * float(LIT_STEPS)));
        look_up_light(LIT_STEPS == 1 ? p : middle, ray.direction);
    }
}

// The light of a ray as it is shown, premultiplied.
vec4 developed(vec3 light, float opacity, ivec2 pixel, ivec2 size) {
    return LIT == 0 ? vec4(light, opacity) : on_film(light, opacity, pixel, size);
}
