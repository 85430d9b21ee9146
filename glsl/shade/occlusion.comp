// Ambient occlusion in image space: points of the distance map on a spiral around a pixel occlude it where they rise above its
// tangent plane. (After Mittring 2007 and Bavoil and Sainz 2008: horizon by samples, with falloff to the radius.)
#version 460
#include "common.glsl"
const int SAMPLES = 32;
// Directions at multiples of the golden angle, the nearest floats to their f64 values (src/passes/shade.rs checks them): the precision of
// sin and cos is not bounded beyond -pi..pi.
const vec2 DIRECTIONS[SAMPLES] = vec2[](
    vec2(1.0, 0.0), vec2(-0.7373689, 0.6754903), vec2(0.08742572, -0.99617106),
    vec2(0.60843885, 0.79360074), vec2(-0.9847135, -0.17418195), vec2(0.8437553, -0.536728),
    vec2(-0.2596043, 0.96571505), vec2(-0.460907, -0.88744843), vec2(0.9393213, 0.34303862),
    vec2(-0.92434555, 0.3815564), vec2(0.423846, -0.9057343), vec2(0.29928386, 0.95416415),
    vec2(-0.8652112, -0.50140756), vec2(0.97667575, -0.21471943), vec2(-0.57512945, 0.8180624),
    vec2(-0.12851068, -0.9917081), vec2(0.764649, 0.64444697), vec2(-0.99914604, 0.04131782),
    vec2(0.7088294, -0.70537996), vec2(-0.04619145, 0.9989326), vec2(-0.64070916, -0.7677837),
    vec2(0.99106944, 0.13334699), vec2(-0.82085836, 0.5711318), vec2(0.21948138, -0.9756167),
    vec2(0.49718088, 0.86764693), vec2(-0.95269275, -0.303935), vec2(0.90779114, -0.41942254),
    vec2(-0.3860611, 0.9224732), vec2(-0.33845228, -0.94098353), vec2(0.8851894, 0.46523076),
    vec2(-0.96697, 0.25489017), vec2(0.54083776, -0.8411269)
);
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
            ivec2 tap = ivec2(floor(at + pixels * share * DIRECTIONS[i]));
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
