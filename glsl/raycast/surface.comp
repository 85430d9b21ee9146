// SR: the first surface on each ray (thesis 4-3). D is the mean of the newer half of the last eight samples minus the mean
// of the older half. A rough detector with longer steps ignores specks; where it fires, the ray steps back and a fine
// detector finds the position.
// variants: plain; uniform SWEPT; intra_frame_motion SWEPT INTRA_FRAME_MOTION; non_uniform SWEPT NON_UNIFORM; non_uniform_intra_frame_motion SWEPT NON_UNIFORM INTRA_FRAME_MOTION
#version 460
#include "common.glsl"
layout(constant_id = 6) const int BEHIND = 0; // samples averaged behind the surface
layout(constant_id = 15) const int ECHO = 1;  // 0: nothing reads the echo at the surface, and it is not stored
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float threshold;
    float rough_threshold;
    float polarity; // +1 bright tissue in dark fluid, -1 a dark cavity
    float noise;    // an edge must exceed this many standard deviations of the noise
    float quiet_level;  // samples that do not exceed this cannot fire the detector
    float behind_step;  // distance of the samples behind the surface, mm
};
#include "ray.glsl"
#include "sliding.glsl"
#include "detector.glsl"
#include "empty_space.glsl"
uniform writeonly image2D distance_map;
uniform writeonly image2D surface; // echo at the surface, 1 where one was found, mean echo behind it

// Samples of one search where no empty space is skipped.
const int MAX_SEARCH_SAMPLES = 64;

vec3 place_of(Ray ray, int i) { return ray.origin + ray.direction * (ray.enter + offset_of(ray, float(i) + SAMPLE_AT)); }

// Where D rises above FOLLOW_LEVEL of the peak for the last time before it, samples; NEVER if the ring is not full that early.
float risen_at(Ray ray, inout Slices slices) {
    float level = FOLLOW_LEVEL * best, at = float(NEVER), last = 0.0;
    filled = 0;
    for (int i = max(fine_from, fired - 2 * RING); i <= best_at; ++i) {
        vec3 texel;
        locate(place_of(ray, i), texel);
        float difference = push_sample(sample_along(ray, i, SAMPLE_AT, texel, slices));
        if (filled > RING && last <= level && difference > level) at = float(i) - (difference - level) / (difference - last);
        last = difference;
    }
    return at;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(distance_map)))) return;
    Ray ray = ray_of(pixel);
    int count = ray.leave > ray.enter ? int(steps_to(ray, ray.leave - ray.enter)) : 0;
    // The region limits where surfaces may be, not which samples the detector uses: its ring is filled in front of the region,
    // and an edge that begins inside may peak behind it. Samples behind the camera are not used.
    int first = max(-HALF * ROUGH, int(ceil(steps_to(ray, -ray.enter) - 0.5)));
    int end = count > 0 ? count + HALF * ROUGH + RING : first;

    Slices slices = no_slices();
    segment = fine_from = first;
    bool goes_on = true;
    for (int i = first; goes_on && (i < end || look_again(i));) {
        if (SKIP == 1) {
            RaySegment here = segment_at(ray, i, SAMPLE_AT);
            while (here.kind == EMPTY && state == START && !second_look && i < end) {
                // The same as if each sample were outside.
                i += (here.stop - i + ROUGH - 1) / ROUGH * ROUGH;
                restart(i);
                here = segment_at(ray, i, SAMPLE_AT);
            }
            if (here.kind == HOMOGENEOUS && DETECTOR == 0 && state == START && !second_look && filled >= RING) {
                // Refill the ring with the last samples of the segment, so that it holds what it would hold without skipping.
                int stop = min(here.stop, end);
                int steps = (stop - i + stride - 1) / stride, left = stop == end ? 0 : RING;
                if (is_quiet() && steps > left) {
                    i += (steps - left) * stride;
                    filled = 0;
                }
            }
        }
        // The initial search has its own loop: on a device that runs rays under masks, each sample would otherwise pay for all states.
        // The sample that ends it stays in the ring for the second loop.
        int n = SKIP == 1 ? SAMPLES_PER_LOOKUP : MAX_SEARCH_SAMPLES;
        bool waits = false;
        float difference = 0.0, noise_bar = 0.0;
        for (bool searches = state == START && !second_look && !after_speck; searches && n > 0 && i < end; --n) {
            vec3 texel;
            if (locate(place_of(ray, i), texel)) {
                difference = push_sample(sample_along(ray, i, SAMPLE_AT, texel, slices));
                noise_bar = noise_bar_at(i, difference);
                if (is_event(difference, noise_bar)) {
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
        for (; waits || ((state != START || second_look || after_speck) && n > 0 && i < end); --n) {
            vec3 texel;
            if (waits || locate(place_of(ray, i), texel)) {
                if (!waits) {
                    difference = push_sample(sample_along(ray, i, SAMPLE_AT, texel, slices));
                    noise_bar = noise_bar_at(i, difference);
                }
                waits = false;
                goes_on = step_detector(difference, noise_bar, i);
            } else {
                goes_on = skip_sample(i);
            }
            if (!goes_on) break;
        }
    }
    // The ray ended during the second look: nothing confirms that the echo lasts.
    if (second_look && surfaces_passed < NUMBER) found = false;
    float distance = MISS;
    float behind = 0.0;
    if (found && surfaces_passed + 1 >= NUMBER) {
        float at = offset_of(ray, surface_place(PLACE == 2 ? risen_at(ray, slices) : 0.0) + SAMPLE_AT);
        found = at >= 0.0 && at <= ray.leave - ray.enter;
        if (found) {
            distance = ray.enter + at;
            for (int i = 1; i <= BEHIND; ++i) {
                vec3 texel;
                if (locate(ray.origin + ray.direction * (distance + float(i) * behind_step), texel)) behind += sample_volume(texel);
            }
            behind /= float(max(BEHIND, 1));
        }
    } else {
        found = false;
    }
    imageStore(distance_map, pixel, vec4(distance, 0.0, 0.0, 0.0));
    if (ECHO == 1) imageStore(surface, pixel, vec4(found ? (PLACE > 0 ? top : first_echo) : 0.0, found ? 1.0 : 0.0, behind, 0.0));
}
