// SR and VR of one march (thesis 4.4.2): the surface detector finds the distance of the first surface in the samples that are
// composited along the whole ray. Each sample is taken once, where the detector does not step back. Compositing takes every sample of
// the detector's lattice once and in order, whatever the detector does.
#version 460
#include "common.glsl"
#define TWO_KINDS
layout(constant_id = 15) const int ECHO = 1;  // 0: nothing reads the echo at the surface, and it is not stored
layout(scalar) uniform Params {
#include "ray_params.glsl"
#include "surface_params.glsl"
#include "compositing_params.glsl"
    float volume_window_low; // the grey window of compositing
    float volume_window_scale;
};
#include "ray.glsl"
#include "sliding.glsl"
#include "detector.glsl"
#include "empty_space.glsl"
#include "compositing.glsl"
const bool COMPOSITES = true;
int to_composite = NEVER;
#include "surface_march.glsl"
#include "cap.glsl"
uniform writeonly image2D distance_map;
uniform writeonly image2D surface; // echo at the surface, 1 where one was found, mean echo behind it
uniform writeonly image2D picture; // the composited volume

vec3 colour = vec3(0.0);
float opacity = 0.0;

// Composites step i, with the sample before the window.
void composite(Ray ray, int i, vec3 p, float raw) {
    float length = min(step_length, ray.leave - ray.enter - offset_of(ray, float(i)));
    vec4 entry = looked_up(stretched(raw, volume_window_low, volume_window_scale));
    float a = length > 0.0 ? step_opacity(entry, length, p) : 0.0;
    if (a <= 0.0) return;
    if (LIT == 1) light_step(ray, i, p);
    add_step(entry, a, p, colour, opacity);
}

bool is_opaque() { return EARLY_END == 1 && opacity >= opaque_enough; }

bool take(Ray ray, int i, inout Slices slices, out float value) {
    vec3 p = place_of(ray, i);
    vec3 texel;
    bool inside = locate(p, texel);
    value = OUTSIDE;
    if (inside) {
        float raw = raw_along(ray, i, SAMPLE_AT, texel, slices);
        value = windowed(raw);
        if (i == to_composite) composite(ray, i, p, raw);
    }
    if (i == to_composite) to_composite = i + 1 < complete && !is_opaque() ? i + 1 : NEVER;
    return taken(inside, value);
}

void skip_transparent(Ray ray) {
    // The last complete step is always taken, as in volume.comp.
    int last = complete - 1;
    for (bool skips = to_composite < last; skips;) {
        RaySegment here = volume_segment_at(aimed(ray, to_composite), to_composite, SAMPLE_AT);
        skips = here.kind == EMPTY;
        if (skips) {
            to_composite = min(here.stop, last);
            skips = to_composite < last;
        }
    }
}

void main() {
    ivec2 pixel = ray_pixel();
    if (any(greaterThanEqual(pixel, imageSize(distance_map)))) return;
    keep_pixel(pixel);
    Ray ray = ray_of(pixel);
    vec2 cut = cap_at(pixel);
    bool enters = ray.leave > ray.enter;
    if (is_capped(cut)) ray.leave = -1.0;
    Slices slices = no_slices();
    complete = complete_steps(ray);
    to_composite = complete > 0 ? 0 : NEVER;
    vec3 echo;
    float distance = find_surface(ray, slices, echo);
    // The last step has the length that is left: the detector has no sample in its middle.
    float path = ray.leave - ray.enter;
    float left = min(step_length, path - offset_of(ray, float(complete)));
    if (path > 0.0 && left > 0.0 && !is_opaque()) {
        vec3 p = place_at(aimed(ray, complete), middle_of(ray, complete, left, false));
        vec3 texel;
        if (locate(p, texel)) composite(ray, complete, p, raw_along(ray, complete, SAMPLE_AT, texel, slices));
    }
    pixel = kept_pixel(complete);
    if (is_capped(cut)) distance = enters ? ray.enter : MISS;
    imageStore(distance_map, pixel, vec4(distance, 0.0, 0.0, 0.0));
    if (ECHO == 1) imageStore(surface, pixel, vec4(echo, 0.0));
    vec4 rgba = developed(colour, opacity, pixel, imageSize(picture));
    imageStore(picture, pixel, capped(cut, rgba));
}
