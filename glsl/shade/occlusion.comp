// Ambient occlusion in image space: points of the distance map on a spiral around a pixel occlude it where they rise above its
// tangent plane. (After Mittring 2007 and Bavoil and Sainz 2008: horizon by samples, with falloff to the radius.)
#version 460
#include "common.glsl"
layout(constant_id = 0) const int SAMPLES = 32;
layout(scalar) uniform Params {
#include "camera_params.glsl"
    float radius;   // mm
    float strength;
};
#include "distance_map.glsl"
uniform writeonly image2D occlusion;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(occlusion)))) return;
    float distance = distance_at(pixel);
    float open = 1.0;
    if (is_hit(distance)) {
        vec2 at = vec2(pixel) + 0.5;
        vec3 along_ray = ray_direction(at);
        vec3 here = ray_origin(at) + along_ray * distance;
        vec3 normal = normal_at(pixel, distance, along_ray);
        // The radius in pixels at the surface's distance.
        float pixels = radius / max(length(origin_dx + direction_dx * distance), 1e-30);
        float taken = 0.0;
        for (int i = 0; i < SAMPLES; ++i) {
            // Uniform over the disc's area; the golden angle keeps directions apart.
            float share = sqrt((float(i) + 0.5) / float(SAMPLES));
            float angle = 2.39996323 * float(i);
            ivec2 tap = ivec2(floor(at + pixels * share * vec2(cos(angle), sin(angle))));
            float other = distance_at(tap);
            if (!is_hit(other)) continue;
            vec2 there = vec2(tap) + 0.5;
            vec3 towards = ray_origin(there) + ray_direction(there) * other - here;
            float far = length(towards);
            if (far < 1e-7 * radius) continue;
            float falls = max(1.0 - far * far / (radius * radius), 0.0);
            // The bias of 0.1 ignores the map's own roughness.
            taken += max(dot(normal, towards) / far - 0.1, 0.0) * falls;
        }
        open = clamp(1.0 - strength * 2.0 * taken / float(SAMPLES), 0.0, 1.0);
    }
    imageStore(occlusion, pixel, vec4(open, 0.0, 0.0, 0.0));
}
