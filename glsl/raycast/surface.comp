// SR: the first surface on each ray (thesis 4-3). D is the mean of the newer half of the last eight samples minus the mean
// of the older half. A rough detector with longer steps ignores specks; where it fires, the ray steps back and a fine
// detector finds the position.
#version 460
#include "common.glsl"
layout(constant_id = 15) const int ECHO = 1;  // 0: nothing reads the echo at the surface, and it is not stored
layout(scalar) uniform Params {
#include "ray_params.glsl"
#include "surface_params.glsl"
};
#include "ray.glsl"
#include "sliding.glsl"
#include "detector.glsl"
#include "empty_space.glsl"
const bool COMPOSITES = false;
const int to_composite = NEVER;
#include "surface_march.glsl"
#include "cap.glsl"
uniform writeonly image2D distance_map;
uniform writeonly image2D surface; // echo at the surface, 1 where one was found, mean echo behind it

bool take(Ray ray, int i, inout Slices slices, out float value) {
    vec3 texel;
    bool inside = locate(place_of(ray, i), texel);
    value = OUTSIDE;
    if (inside) value = sample_along(ray, i, SAMPLE_AT, texel, slices);
    return taken(inside, value);
}

void skip_transparent(Ray ray) {}

void main() {
    ivec2 pixel = ray_pixel();
    if (any(greaterThanEqual(pixel, imageSize(distance_map)))) return;
    Slices slices = no_slices();
    keep_pixel(pixel);
    Ray ray = ray_of(pixel);
    bool ends = is_capped(cap_at(pixel)), enters = ray.leave > ray.enter;
    if (ends) ray.leave = -1.0;
    vec3 echo;
    float distance = find_surface(ray, slices, echo);
    pixel = kept_pixel(complete);
    if (ends) distance = enters ? ray.enter : MISS;
    imageStore(distance_map, pixel, vec4(distance, 0.0, 0.0, 0.0));
    if (ECHO == 1) imageStore(surface, pixel, vec4(echo, 0.0));
}
