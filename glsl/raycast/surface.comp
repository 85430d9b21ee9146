// SR: the first surface on each ray (thesis 4-3). D is the mean of the newer half of the last eight samples minus the mean
// of the older half. A rough detector with longer steps rides over specks; where it fires, the ray steps back and a fine
// one finds the place.
// variants: plain; even SWEPT; moved SWEPT MOVED; uneven SWEPT UNEVEN; uneven_moved SWEPT UNEVEN MOVED
#version 460
#include "common.glsl"
layout(constant_id = 3) const int ROUGH = 2; // fine steps in a rough one; 1: no rough detector
layout(constant_id = 4) const int PEAK = 1;   // 0: the first crossing is the place
layout(constant_id = 5) const int NUMBER = 1; // which surface of the ray
layout(constant_id = 6) const int BEHIND = 0; // samples averaged behind the surface
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float threshold;
    float rough_threshold;
    float polarity; // +1 bright tissue in dark fluid, -1 a dark cavity
};
#include "ray.glsl"
#include "sliding.glsl"
uniform writeonly image2D distance_map;
uniform writeonly image2D surface; // echo at the surface, 1 where one was found, mean echo behind it

const int RING = 8;
const int SEARCH_ROUGH = 0, SEARCH_FINE = 1, FOLLOW = 2;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(distance_map)))) return;
    Ray ray = ray_of(pixel);
    int count = ray.leave > ray.enter ? int(steps_to(ray, ray.leave - ray.enter)) : 0;
    // The region bounds where surfaces lie, not what the detector may look at: its ring is filled before the region begins,
    // and an edge that rises inside may peak behind it. Nothing lies behind the camera.
    int first = max(-RING / 2 * ROUGH, int(ceil(steps_to(ray, -ray.enter) - 0.5)));
    int end = count > 0 ? count + RING / 2 * ROUGH + RING : first;

    const int start = ROUGH > 1 ? SEARCH_ROUGH : SEARCH_FINE;
    int state = start;
    int stride = ROUGH;
    int limit = 0x7fffffff; // the fine search gives up here
    int segment = first;    // first sample since the ray entered the insonified region
    int filled = 0;
    int fired = 0;
    int seen = 0; // surfaces left behind
    bool found = false;
    vec4 older = vec4(0.0), newer = vec4(0.0);
    float previous = 0.0;
    // The largest difference since the crossing, its neighbours, its sample and the echo behind it. Until the sample after it
    // is known it may not be the largest, and there is no surface.
    float best = 0.0, before = 0.0, after = 0.0, echo = 0.0;
    int best_at = 0;

    Slices slices = no_slices();
    for (int i = first; i < end;) {
        vec3 p = ray.origin + ray.direction * (ray.enter + offset_of(ray, float(i) + SAMPLE_AT));
        vec3 texel;
        if (!locate(p, texel)) {
            if (state == FOLLOW) break;
            // The detector starts anew behind a gap.
            filled = 0;
            state = start;
            stride = ROUGH;
            limit = 0x7fffffff;
            i += stride;
            segment = i;
            continue;
        }
        older = vec4(older.yzw, newer.x);
        newer = vec4(newer.yzw, sample_along(ray, i, SAMPLE_AT, texel, slices));
        ++filled;
        float difference = polarity * dot(newer - older, vec4(0.25));
        bool ready = filled >= RING;
        if (ROUGH > 1 && state == SEARCH_ROUGH) {
            if (ready && difference > rough_threshold) {
                limit = i + RING;
                i = max(i - RING * ROUGH, segment);
                state = SEARCH_FINE;
                stride = 1;
                filled = 0;
                continue;
            }
        } else if (state == SEARCH_FINE) {
            // A crossing: an edge that was there before the region began is not one.
            if (ready && i >= RING / 2 && difference > threshold && (filled == RING || previous <= threshold)) {
                state = FOLLOW;
                fired = i;
                best = difference;
                best_at = i;
                before = filled > RING ? previous : difference;
                echo = dot(newer, vec4(0.25));
                found = PEAK == 0;
                if (PEAK == 0 && seen + 1 == NUMBER) break;
            } else if (ROUGH > 1 && i >= limit) {
                // A false alarm: the rough ring is refilled so that its next word is about what the fine one has not seen.
                state = SEARCH_ROUGH;
                stride = ROUGH;
                filled = 0;
                i = limit - (RING - 2) * ROUGH;
                segment = i;
                continue;
            }
        } else {
            if (i == best_at + 1) {
                after = difference;
                found = true;
            }
            if (i >= fired + RING) {
                if (++seen == NUMBER) break;
                // The next surface is looked for from here.
                state = start;
                stride = ROUGH;
                filled = 0;
                segment = i;
                limit = 0x7fffffff;
                found = false;
                continue;
            }
            if (PEAK == 1 && difference > best) {
                best = difference;
                best_at = i;
                before = previous;
                found = false;
                echo = dot(newer, vec4(0.25));
            }
        }
        previous = difference;
        i += stride;
    }
    float distance = MISS;
    float behind = 0.0;
    if (found && seen + 1 >= NUMBER) {
        float place = float(best_at);
        if (PEAK == 1) {
            // The edge lies in the middle of the ring where the difference peaks; a parabola through the neighbours refines.
            float bend = before - 2.0 * best + after;
            // Two equal differences put it in the middle between them, whichever came out larger by rounding.
            float shift = bend < 0.0 ? clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
            place += shift - 0.5 * float(RING - 1);
        }
        float at = offset_of(ray, place + SAMPLE_AT);
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
    imageStore(surface, pixel, vec4(found ? echo : 0.0, found ? 1.0 : 0.0, behind, 0.0));
}
