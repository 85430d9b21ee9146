// Normals from the distance map, and Blinn-Phong (thesis 4-4..4-7) with a directional light.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    vec3 origin_dx;
    vec3 origin_dy;
    vec3 direction;
    vec3 direction_dx;
    vec3 direction_dy;
    vec3 to_light; // unit
    float ambient;
    float diffuse;
    float specular;
    float shininess;
    vec3 light_colour;
    vec3 surface_colour;
    float texture_share;
    float cliff; // mm
};
uniform texture2D distance_map;
uniform texture2D surface;
uniform writeonly image2D picture;

vec3 ray_direction(vec2 at) { return normalize(direction + direction_dx * at.x + direction_dy * at.y); }

float distance_at(ivec2 pixel) {
    ivec2 size = textureSize(distance_map, 0);
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) return MISS;
    return texelFetch(distance_map, pixel, 0).x;
}

// Change of place over one pixel along `along`: central where both neighbours belong to the same surface, one-sided where
// one does, and a plane facing the viewer where none does. Nothing is taken across a cliff.
vec3 slope(ivec2 pixel, ivec2 along, float here, vec3 facing) {
    float back = distance_at(pixel - along), on = distance_at(pixel + along);
    bool use_back = abs(back - here) <= cliff, use_on = abs(on - here) <= cliff;
    if (!use_back && !use_on) return facing;
    ivec2 first = use_back ? pixel - along : pixel, second = use_on ? pixel + along : pixel;
    float near = use_back ? back : here, far = use_on ? on : here;
    vec3 first_ray = ray_direction(vec2(first) + 0.5), second_ray = ray_direction(vec2(second) + 0.5);
    vec2 steps = vec2(second - first);
    // The difference of two places, term by term: subtracting the places would cancel all but a few of f32's digits.
    return origin_dx * steps.x + origin_dy * steps.y + second_ray * (far - near) + (second_ray - first_ray) * near;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    float distance = distance_at(pixel);
    if (!is_hit(distance)) {
        imageStore(picture, pixel, vec4(0.0));
        return;
    }
    vec3 along_ray = ray_direction(vec2(pixel) + 0.5);
    // Pixel axes in space at unit distance: what a surface that faces the viewer spans.
    vec3 dx = origin_dx + direction_dx, dy = origin_dy + direction_dy;
    vec3 sx = slope(pixel, ivec2(1, 0), distance, dx);
    vec3 sy = slope(pixel, ivec2(0, 1), distance, dy);
    vec3 normal = cross(sy, sx);
    float size = length(normal);
    normal = size > 1e-30 ? normal / size : -along_ray;
    if (dot(normal, along_ray) > 0.0) normal = -normal;

    float facing = max(dot(normal, to_light), 0.0);
    vec3 halfway = to_light - along_ray;
    float half_length = length(halfway);
    float gloss = half_length > 1e-6 ? clamp(dot(normal, halfway) / half_length, 0.0, 1.0) : 0.0;
    // pow(0, 0) is undefined: a gloss of 0 shines nowhere unless the exponent is 0, when it shines evenly.
    float shine = shininess == 0.0 ? 1.0 : (gloss > 0.0 ? min(pow(gloss, shininess), 1.0) : 0.0);
    vec2 echo = texelFetch(surface, pixel, 0).xy;
    vec3 colour = surface_colour * mix(1.0, echo.x, texture_share * echo.y);
    vec3 lit = light_colour * (colour * (ambient + diffuse * facing) + vec3(specular * shine * (facing > 0.0 ? 1.0 : 0.0)));
    imageStore(picture, pixel, vec4(lit, 1.0));
}
