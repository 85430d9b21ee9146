// Blinn-Phong with normals from the distance map (thesis 4-4..4-7), shadow and occlusion where the scene has them, and skin.
// Variants by what is lit: a surface; BEHIND_LAYER, a surface behind a composited volume; COMPOSITED, the volume itself; COLOURED,
// a surface with the colour that volume rendering gives its ray.
// variants: plain; shadowed SHADOWED; occluded OCCLUDED; shadowed_occluded SHADOWED OCCLUDED; behind_layer_plain BEHIND_LAYER; behind_layer_shadowed BEHIND_LAYER SHADOWED; behind_layer_occluded BEHIND_LAYER OCCLUDED; behind_layer_shadowed_occluded BEHIND_LAYER SHADOWED OCCLUDED; composited_plain COMPOSITED; composited_shadowed COMPOSITED SHADOWED; composited_occluded COMPOSITED OCCLUDED; composited_shadowed_occluded COMPOSITED SHADOWED OCCLUDED; coloured_plain COLOURED; coloured_shadowed COLOURED SHADOWED; coloured_occluded COLOURED OCCLUDED; coloured_shadowed_occluded COLOURED SHADOWED OCCLUDED
#version 460
#include "common.glsl"
layout(constant_id = 0) const int POINT = 0; // 0: directional light, 1: point light
layout(constant_id = 1) const int SKIN = 0;
#ifndef COMPOSITED
layout(constant_id = 4) const int ECHO = 1; // 0: neither texture nor skin needs the echo at the surface
#endif
#ifdef SHADOWED
layout(constant_id = 2) const int DIMS_PIXEL = 0; // 1: a shadow dims ambient light too
#endif
#ifdef COLOURED
layout(constant_id = 3) const int AMBIENT_ONLY = 0; // 1: the volume's colour is that of ambient light alone (thesis 4-5)
#endif
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
#ifndef COMPOSITED
uniform texture2D surface; // echo, found, mean echo behind
#endif
#if defined(BEHIND_LAYER) || defined(COMPOSITED) || defined(COLOURED)
uniform texture2D volume_layer; // colours times opacity, opacity
#endif
#ifdef SHADOWED
uniform texture2D shadow; // light that arrives, 0..1
#endif
#ifdef OCCLUDED
uniform texture2D occlusion; // ambient light that arrives, 0..1
#endif
uniform writeonly image2D picture;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    float distance = distance_at(pixel);
    vec4 before = vec4(0.0);
#ifdef BEHIND_LAYER
    before = layer_share * texelFetch(volume_layer, pixel, 0);
#endif
#ifdef COMPOSITED
    before = texelFetch(volume_layer, pixel, 0);
#endif
    if (!is_hit(distance)) {
        imageStore(picture, pixel, before);
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
#ifdef COMPOSITED
    const vec4 echo = vec4(1.0, 1.0, 1.0, 0.0); // thickness is unknown
    const vec3 colour = vec3(1.0);
#else
    vec4 echo = vec4(1.0, 1.0, 1.0, 0.0);
    if (ECHO == 1) echo = texelFetch(surface, pixel, 0);
    vec3 colour = vec3(mix(1.0, echo.x, texture_share * echo.y));
#ifndef COLOURED
    colour *= surface_colour;
#endif
#endif
#ifdef COLOURED
    vec3 ambient_colour = colour * texelFetch(volume_layer, pixel, 0).rgb;
    if (AMBIENT_ONLY == 0) colour = ambient_colour;
#endif

    float lit = 1.0, open = 1.0, dimmed = 1.0;
#ifdef SHADOWED
    lit = 1.0 - shadow_strength * (1.0 - texelFetch(shadow, pixel, 0).x);
    if (DIMS_PIXEL == 1) {
        dimmed = lit;
        lit = 1.0;
    }
#endif
#ifdef OCCLUDED
    open = texelFetch(occlusion, pixel, 0).x;
#endif
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
#ifdef COLOURED
    vec3 body = ambient_colour * ambient * open + colour * diffuse * diffused * mix(1.0, open, 0.3);
#else
    vec3 body = colour * (ambient * open + diffuse * diffused * mix(1.0, open, 0.3));
#endif
    vec3 sum = dimmed * (body + glow * open);
    vec3 highlight = vec3(specular * shine * lit * dimmed * (facing > 0.0 ? 1.0 : 0.0));
#ifdef COMPOSITED
    // Lighting is weighted by opacity.
    imageStore(picture, pixel, vec4(before.rgb * mix(vec3(1.0), light_colour * sum, before.a) + before.a * light_colour * highlight, before.a));
#else
    imageStore(picture, pixel, vec4(before.rgb + (1.0 - before.a) * light_colour * (sum + highlight), 1.0));
#endif
}
