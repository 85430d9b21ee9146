// SR: the first surface on each ray (thesis 4-3). D is the mean of the newer half of the last eight samples minus the mean
// of the older half. A rough detector with longer steps rides over specks; where it fires, the ray steps back and a fine
// one finds the place.
// variants: plain; even SWEPT; moved SWEPT MOVED; uneven SWEPT UNEVEN; uneven_moved SWEPT UNEVEN MOVED
#version 460
#include "common.glsl"
layout(constant_id = 6) const int BEHIND = 0; // samples averaged behind the surface
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float threshold;
    float rough_threshold;
    float polarity; // +1 bright tissue in dark fluid, -1 a dark cavity
    float noise;    // deviations of the noise that an edge stands out by
    float silence;  // samples that do not exceed it cannot fire the detector
};
#include "ray.glsl"
#include "sliding.glsl"
#include "detector.glsl"
#include "skip.glsl"
uniform writeonly image2D distance_map;
uniform writeonly image2D surface; // echo at the surface, 1 where one was found, mean echo behind it

// Samples of one search, where nothing is leapt over.
const int LONGEST = 64;

vec3 place_of(Ray ray, int i) { return ray.origin + ray.direction * (ray.enter + offset_of(ray, float(i) + SAMPLE_AT)); }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(distance_map)))) return;
    Ray ray = ray_of(pixel);
    int count = ray.leave > ray.enter ? int(steps_to(ray, ray.leave - ray.enter)) : 0;
    // The region bounds where surfaces lie, not what the detector may look at: its ring is filled before the region begins,
    // and an edge that rises inside may peak behind it. Nothing lies behind the camera.
    int first = max(-RING / 2 * ROUGH, int(ceil(steps_to(ray, -ray.enter) - 0.5)));
    int end = count > 0 ? count + RING / 2 * ROUGH + RING : first;

    Slices slices = no_slices();
    segment = first;
    bool goes_on = true;
    for (int i = first; goes_on && (i < end || look_again(i));) {
        if (SKIP == 1) {
            Stretch here = stretch_at(ray, i, SAMPLE_AT);
            while (here.kind == NOTHING && state == START && !again && i < end) {
                // As if each sample had been found to lie outside.
                i += (here.stop - i + ROUGH - 1) / ROUGH * ROUGH;
                restart(i);
                here = stretch_at(ray, i, SAMPLE_AT);
            }
            if (here.kind == KNOWN && DETECTOR == 0 && state == START && !again && filled >= RING) {
                vec4 most = max(older, newer);
                bool calm = max(max(most.x, most.y), max(most.z, most.w)) <= silence;
                // The ring is filled anew with the last samples of the stretch: what follows finds it as it would have been.
                int stop = min(here.stop, end);
                int steps = (stop - i + stride - 1) / stride, left = stop == end ? 0 : RING;
                if (calm && steps > left) {
                    i += (steps - left) * stride;
                    filled = 0;
                }
            }
        }
        // The search that a ray begins with, by itself: on a device that runs rays side by side under masks each sample would else pay for
        // every state that it is not in. What ends it is left in the ring for the other loop.
        int n = SKIP == 1 ? BLOCK : LONGEST;
        bool waits = false;
        float difference = 0.0, doubt = 0.0;
        for (bool searches = state == START && !again && !anew; searches && n > 0 && i < end; --n) {
            vec3 texel;
            if (locate(place_of(ray, i), texel)) {
                difference = push_sample(sample_along(ray, i, SAMPLE_AT, texel, slices));
                doubt = doubt_at(i, difference);
                if (is_event(difference, doubt)) {
                    waits = true;
                    searches = false;
                } else {
                    previous = difference;
                    i += stride;
                }
            } else {
                i += ROUGH;
                restart(i);
            }
        }
        for (; waits || ((state != START || again || anew) && n > 0 && i < end); --n) {
            vec3 texel;
            if (waits || locate(place_of(ray, i), texel)) {
                if (!waits) {
                    difference = push_sample(sample_along(ray, i, SAMPLE_AT, texel, slices));
                    doubt = doubt_at(i, difference);
                }
                waits = false;
                goes_on = judge(difference, doubt, i);
            } else {
                goes_on = skip_sample(i);
            }
            if (!goes_on) break;
        }
    }
    // The ray ended before the second look was through: nothing says that this edge lasts.
    if (again && seen < NUMBER) found = false;
    float distance = MISS;
    float behind = 0.0;
    if (found && seen + 1 >= NUMBER) {
        float at = offset_of(ray, surface_place() + SAMPLE_AT);
        found = at >= 0.0 && at <= ray.leave - ray.enter;
        if (found) {
            distance = ray.enter + at;
            for (int i = 1; i <= BEHIND; ++i) {
                vec3 texel;
                if (locate(ray.origin + ray.direction * (distance + float(i) * step_length), texel)) behind += sample_volume(texel);
            }
            behind /= float(max(BEHIND, 1));
        }
    } else {
        found = false;
    }
    imageStore(distance_map, pixel, vec4(distance, 0.0, 0.0, 0.0));
    imageStore(surface, pixel, vec4(found ? (PEAK == 1 ? top : first_echo) : 0.0, found ? 1.0 : 0.0, behind, 0.0));
}
