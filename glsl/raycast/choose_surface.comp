// The surface of each ray: the candidate, or none, that the paths to its pixel make the cheapest.
#version 460
#include "common.glsl"
layout(constant_id = 15) const int ECHO = 1;  // 0: nothing reads the echo at the surface, and it is not stored
layout(constant_id = 6) const int BEHIND = 0; // samples averaged behind the surface
layout(constant_id = 24) const int HALF = 4;  // samples of the echo at the surface, over the length of an edge
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float behind_step; // distance of the samples behind the surface, mm
};
#include "ray.glsl"
#include "cap.glsl"
uniform texture2D candidates;
uniform texture2D from_left;
uniform texture2D from_right;
uniform texture2D from_top;
uniform texture2D from_bottom;
uniform writeonly image2D distance_map;
uniform writeonly image2D surface; // echo at the surface, 1 where one was found, mean echo behind it

// Mean of samples behind a distance, the first `first` steps behind it.
float mean_behind(Ray ray, float distance, float first, float apart, int count) {
    float sum = 0.0;
    for (int n = 0; n < count; ++n) {
        vec3 texel;
        if (locate(ray.origin + ray.direction * (distance + (float(n) + first) * apart), texel)) sum += sample_volume(texel);
    }
    return sum / float(max(count, 1));
}

void main() {
    ivec2 pixel = ray_pixel();
    if (any(greaterThanEqual(pixel, imageSize(distance_map)))) return;
    vec2 places = texelFetch(candidates, pixel, 0).xy;
    vec2 more = texelFetch(from_left, pixel, 0).xy + texelFetch(from_right, pixel, 0).xy
              + texelFetch(from_top, pixel, 0).xy + texelFetch(from_bottom, pixel, 0).xy;
    float distance = min(more.x, more.y) > 0.0 ? MISS : more.y < more.x ? places.y : places.x;
    Ray ray = ray_of(pixel);
    bool ends = is_capped(cap_at(pixel));
    bool is_surface = is_hit(distance) && !ends;
    if (ends) distance = ray.leave > ray.enter ? ray.enter : MISS;
    imageStore(distance_map, pixel, vec4(distance, 0.0, 0.0, 0.0));
    if (ECHO == 1) {
        vec3 echo = vec3(0.0);
        if (is_surface) {
            echo = vec3(mean_behind(ray, distance, 0.5, step_length, HALF), 1.0, mean_behind(ray, distance, 1.0, behind_step, BEHIND));
        }
        imageStore(surface, pixel, vec4(echo, 0.0));
    }
}
