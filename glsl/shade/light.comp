// Blinn-Phong with normals from the distance map (thesis 4-4..4-7), shadow and occlusion where the scene has them, and skin.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int POINT = 0; // 0: directional light, 1: point light
layout(constant_id = 1) const int SKIN = 0;
layout(constant_id = 2) const int DIMS_PIXEL = 0; // 1: a shadow dims ambient light too
layout(constant_id = 3) const int AMBIENT_ONLY = 0; // 1: the volume's colour is that of ambient light, which the light does not colour (thesis 4-5)
layout(constant_id = 4) const int ECHO = 1; // 0: neither texture nor skin needs the echo at the surface
const int BEHIND_LAYER = 1; // a surface behind a composited volume
const int COMPOSITED = 2;   // the volume itself, where rays hit it first
const int COLOURED = 3;     // a surface with the colour that volume rendering gives its ray
layout(constant_id = 5) const int SUBJECT = 0; // what is lit: 0 a surface, or one of the above
layout(constant_id = 6) const int SHADOWED = 0;
layout(constant_id = 7) const int OCCLUDED = 0;
layout(scalar) uniform Params {
#include "camera_params.glsl"
    vec3 light_at; // unit direction to a directional light, or position of a point light in mm
    float ambient;
    float diffuse;
    float specular;
    float shininess;
    vec3 light_colour;
    vec3 surface_colour;
    float texture_share;
    float shadow_strength;
    vec3 wrap;          // per channel
    vec3 through;       // colour of light through thin tissue, times translucency
    float layer_share;   // weight of the composited volume over a surface
};
#include "distance_map.glsl"
uniform texture2D surface;      // of ECHO: echo, found, mean echo behind
uniform texture2D volume_layer; // of everything but a plain surface: colours times opacity, opacity
uniform texture2D shadow;       // of SHADOWED: light that arrives, 0..1
uniform texture2D occlusion;    // of OCCLUDED: ambient light that arrives, 0..1
uniform writeonly image2D picture;
#include "cap.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    vec2 cut = cap_at(pixel);
    if (ends_ray(cut)) {
        // Echoes are not lit.
        imageStore(picture, pixel, capped(cut, vec4(0.0)));
        return;
    }
    float distance = distance_at(pixel);
    vec4 before = vec4(0.0);
    if (SUBJECT == BEHIND_LAYER) before = layer_share * texelFetch(volume_layer, pixel, 0);
    else if (SUBJECT == COMPOSITED) before = texelFetch(volume_layer, pixel, 0);
    if (!is_hit(distance)) {
        imageStore(picture, pixel, capped(cut, before));
        return;
    }
    vec3 along_ray = ray_direction(vec2(pixel) + 0.5);
    vec3 normal = normal_at(pixel, distance, along_ray);
    vec3 to_light = light_at;
    if (POINT == 1) {
        // A light on the surface, as far as f32 can tell, shines along the normal.
        vec3 towards = light_at - (ray_origin(vec2(pixel) + 0.5) + along_ray * distance);
        float far = length(towards);
        to_light = far > 1e-7 * distance ? towards / far : normal;
    }

    float cosine = dot(normal, to_light);
    float facing = max(cosine, 0.0);
    vec3 halfway = to_light - along_ray;
    float half_length = length(halfway);
    float gloss = half_length > 1e-6 ? clamp(dot(normal, halfway) / half_length, 0.0, 1.0) : 0.0;
    // pow(0, 0) is undefined. A gloss of 0 has no highlight, unless the exponent is 0: then the highlight is constant.
    float shine = shininess == 0.0 ? 1.0 : (gloss > 0.0 ? min(pow(gloss, shininess), 1.0) : 0.0);
    vec4 echo = vec4(1.0, 1.0, 1.0, 0.0); // of a composited volume the thickness is unknown
    vec3 colour = vec3(1.0);
    if (SUBJECT != COMPOSITED) {
        if (ECHO == 1) echo = texelFetch(surface, pixel, 0);
        colour = vec3(mix(1.0, echo.x, texture_share * echo.y));
        if (SUBJECT != COLOURED) colour *= surface_colour;
    }
    vec3 ambient_colour = colour;
    if (SUBJECT == COLOURED) {
        ambient_colour = colour * texelFetch(volume_layer, pixel, 0).rgb;
        if (AMBIENT_ONLY == 0) colour = ambient_colour;
    }

    float lit = 1.0, open = 1.0, dimmed = 1.0;
    if (SHADOWED == 1) {
        lit = 1.0 - shadow_strength * (1.0 - texelFetch(shadow, pixel, 0).x);
        if (DIMS_PIXEL == 1) {
            dimmed = lit;
            lit = 1.0;
        }
    }
    if (OCCLUDED == 1) open = texelFetch(occlusion, pixel, 0).x;
    vec3 diffused = vec3(facing) * lit;
    vec3 glow = vec3(0.0);
    if (SKIN == 1) {
        // Wrapped diffuse light with a share per channel. Shadows turn red first, as light under skin does.
        vec3 wrapped = max((vec3(cosine) + wrap) / (1.0 + wrap), vec3(0.0));
        diffused = wrapped * mix(vec3(lit), vec3(1.0), 0.5 * wrap);
        // Thin where few echoes follow the surface; strongest with the light behind.
        float thin = echo.y * (1.0 - clamp(echo.z, 0.0, 1.0));
        glow = through * thin * (0.35 + 0.65 * max(-cosine, 0.0));
    }
    vec3 unlit = AMBIENT_ONLY == 1 ? dimmed * ambient_colour * ambient * open : vec3(0.0);
    vec3 body = AMBIENT_ONLY == 1 ? colour * diffuse * diffused * mix(1.0, open, 0.3)
        : SUBJECT == COLOURED     ? ambient_colour * ambient * open + colour * diffuse * diffused * mix(1.0, open, 0.3)
                                  : colour * (ambient * open + diffuse * diffused * mix(1.0, open, 0.3));
    vec3 sum = dimmed * (body + glow * open);
    vec3 highlight = vec3(specular * shine * lit * dimmed * (facing > 0.0 ? 1.0 : 0.0));
    // Of a composited volume lighting is weighted by opacity.
    vec4 rgba = SUBJECT == COMPOSITED
        ? vec4(before.rgb * mix(vec3(1.0), light_colour * sum, before.a) + before.a * light_colour * highlight, before.a)
        : AMBIENT_ONLY == 1   ? vec4(unlit + light_colour * (sum + highlight), 1.0)
                              : vec4(before.rgb + (1.0 - before.a) * light_colour * (sum + highlight), 1.0);
    imageStore(picture, pixel, capped(cut, rgba));
}
