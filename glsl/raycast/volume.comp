// VR: emission and absorption, front to back (thesis 4-1, 4-2).
#version 460
#extension GL_EXT_control_flow_attributes : require
#include "common.glsl"
const int LAYER = 1;  // the ray ends at the surface; the result is a layer in front of it
const int BEHIND = 2; // the ray begins at the surface and ends at a depth behind it; the result is the surface's colour
const int HIT = 3;    // the position where the ray becomes opaque enough is stored, to be lit
layout(constant_id = 3) const int PART = 0; // 0: the whole ray, or one of the above
layout(constant_id = 46) const int STEPS_AT_ONCE = 1; // of a turn of the loop: LIT_STEPS where both sides of a branch cost, else 1
layout(constant_id = 42) const int MIDDLE_OF = 1; // rays along each edge of a pixel, in place of which the one in the middle is cast
layout(constant_id = 43) const int REFINED = 0;   // more than 0: so many along each edge of the pixels that are marked, none of the others
layout(scalar) uniform Params {
#include "ray_params.glsl"
#include "compositing_params.glsl"
    float hit_opacity;      // a hit is recorded at this opacity
    float colour_depth;     // behind the surface, mm
};
#include "ray.glsl"
#include "sliding.glsl"
Ray aimed(Ray ray, int i) { return ray; }
#include "empty_space.glsl"
#include "compositing.glsl"
#include "cap.glsl"
uniform writeonly image2D picture;
uniform texture2D distance_map;         // of LAYER and BEHIND
uniform writeonly image2D hit_distance; // of HIT
uniform texture2D marks;                // of REFINED: 1 in pixels that have several rays

vec4 looked_up_between(float front, float back) {
    vec2 e = vec2(front, back) * float(ENTRIES - 1);
    ivec2 n = min(ivec2(e), ivec2(ENTRIES - 2));
    vec2 share = e - vec2(n);
    int row = n.x * ENTRIES + n.y;
    vec4 here = mix(transfer.entry[row], transfer.entry[row + 1], share.y);
    vec4 next = mix(transfer.entry[row + ENTRIES], transfer.entry[row + ENTRIES + 1], share.y);
    return mix(here, next, share.x);
}

// Premultiplied colour and opacity of a step of another length than the table's, y times as long as the length that opacities
// refer to: the same integral by parts of a step that are homogeneous.
const int PARTS = 32;
vec4 short_step(float front, float back, float y) {
    vec3 light = vec3(0.0);
    float depth = 0.0;
    for (int i = 0; i < PARTS; ++i) {
        float e = mix(front, back, (float(i) + 0.5) / float(PARTS)) * float(ENTRIES - 1);
        int n = min(int(e), ENTRIES - 2), at = ENTRIES * ENTRIES + n;
        vec4 entry = mix(transfer.entry[at], transfer.entry[at + 1], e - float(n));
        float part = entry.a * y / float(PARTS);
        light += exp(-depth) * opacity_of(part) * entry.rgb;
        depth += part;
    }
    return vec4(light, opacity_of(depth));
}

void main() {
    ivec2 pixel = ray_pixel();
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    if (REFINED > 0 && texelFetch(marks, pixel / max(REFINED, 1), 0).x == 0.0) return;
    int face;
    Ray ray = ray_through((vec2(pixel) + 0.5) * float(MIDDLE_OF), face);
    if (PART == LAYER) {
        ray.leave = min(ray.leave, texelFetch(distance_map, pixel, 0).x);
    } else if (PART == BEHIND) {
        // A miss is farther away than any box.
        float surface = texelFetch(distance_map, pixel, 0).x;
        ray.enter = max(ray.enter, surface);
        ray.leave = min(ray.leave, surface + colour_depth);
    }
    vec2 cut = cap_at(pixel);
    bool enters = ray.leave > ray.enter;
    if (ends_ray(cut)) ray.leave = -1.0;
    float path = ray.leave - ray.enter;
    vec3 colour = vec3(0.0);
    float opacity = 0.0;
    float hit = MISS;
    if (path > 0.0) {
        Slices slices = no_slices();
        const bool between = COMPOSITING >= 2;
        const float sample_at = between ? 0.0 : SAMPLE_AT;
        float front = 0.0;
        vec4 front_place = vec4(0.0);
        bool front_inside = false;
        if (between) {
            vec3 texel;
            front_inside = locate(ray.origin + ray.direction * ray.enter, texel, front_place);
            if (front_inside) front = sample_along(ray, 0, sample_at, texel, slices);
        }
        // One more than there are where their number comes from a logarithm, which rounding may lower.
        int complete = int(steps_to(ray, path)) + SPREAD;
        // The last steps have other lengths: they are always taken.
        int last = complete - 1 - SPREAD;
        for (int i = 0; i <= complete;) {
            int stop = complete + 1;
            bool front_known = false;
            int to = i;
            if (SKIP == 1) {
                const float place = between ? 1.0 : SAMPLE_AT;
                RaySegment here = segment_at(ray, i, place);
                while (here.kind == EMPTY && to < last) {
                    to = min(here.stop, last);
                    here = segment_at(ray, to, place);
                }
                bool more = to < last;
                if (!between) {
                    // Rays next to each other look up light at the same turn of the loop. What is taken again is empty.
                    i = max(i, to / LIT_STEPS * LIT_STEPS);
                } else if (to > i) {
                    // A step also uses the sample in front of it: the first step after a visible sample is taken, and the last skipped
                    // step fetches the front sample of the next one.
                    front_known = front_inside;
                    if (!front_known) i = to - 1;
                }
                if (more) stop = min(stop, i + (front_known ? 1 : SAMPLES_PER_LOOKUP));
                else if (front_known) stop = i + 1;
            }
            // A CPU takes steps that share their light together: it looks light up whether a step adds something or not. `stop` is behind the last of them, or
            // behind the end of the ray. A GPU needs more registers for that, and is no faster.
            for (; i < stop; i += STEPS_AT_ONCE) {
                vec4 entry[STEPS_AT_ONCE];
                vec3 place_of[STEPS_AT_ONCE];
                float begin[STEPS_AT_ONCE], length[STEPS_AT_ONCE], added[STEPS_AT_ONCE];
                bool is_taken[STEPS_AT_ONCE], adds = false;
                [[unroll]] for (int n = 0; n < STEPS_AT_ONCE; ++n) {
                    int step = i + n;
                    // Midpoints of the steps, or their ends. The last step has the remaining length.
                    begin[n] = offset_of(ray, float(step));
                    length[n] = min(length_of(ray, float(step)), path - begin[n]);
                    vec3 p = place_at(ray, between ? begin[n] + length[n] : middle_of(ray, step, length[n], step < complete));
                    place_of[n] = p;
                    vec3 texel;
                    vec4 place;
                    bool inside = between ? locate(p, texel, place) : locate(p, texel);
                    is_taken[n] = length[n] > 0.0 && (between || inside);
                    added[n] = 0.0;
                    entry[n] = vec4(0.0);
                    if (is_taken[n] && between) {
                        float back = inside ? sample_along(ray, step + 1, sample_at, texel, slices) : 0.0;
                        is_taken[n] = inside || front_inside;
                        // A step over the sector's border is as long as its part inside, and has the value of the end inside.
                        if (SWEEP > 0 && inside != front_inside) {
                            float share = inside ? share_inside(place, front_place) : share_inside(front_place, place);
                            if (inside) begin[n] += length[n] * (1.0 - share);
                            length[n] *= share;
                        }
                        float near = front_inside ? front : back, far = inside ? back : front;
                        if (COMPOSITING == 3 && length[n] < step_length) entry[n] = short_step(near, far, absorption_scale * (length[n] / step_length));
                        else entry[n] = looked_up_between(near, far);
                        front = back;
                        front_place = place;
                        front_inside = inside;
                    } else if (is_taken[n]) {
                        entry[n] = looked_up(sample_along(ray, step, sample_at, texel, slices));
                    }
                    if (is_taken[n]) added[n] = step_opacity(entry[n], length[n], p);
                    adds = adds || added[n] > 0.0;
                }
                if (LIT == 1 && adds) light_step(ray, i, place_of[0]);
                [[unroll]] for (int n = 0; n < STEPS_AT_ONCE; ++n) {
                    if (is_taken[n] && stop >= 0) {
                        float before = opacity;
                        add_step(entry[n], added[n], place_of[n], colour, opacity);
                        // Interpolated between two samples, so that the surface has no terraces.
                        if (PART == HIT && hit == MISS && opacity >= hit_opacity) {
                            float share = (hit_opacity - before) / max(opacity - before, 1e-12);
                            hit = ray.enter + begin[n] + length[n] * clamp(share, 0.0, 1.0);
                        }
                        if (EARLY_END == 1 && opacity >= opaque_enough) complete = stop = -1;
                    }
                }
            }
            // What is skipped next ends with a sample that this ray has not taken yet.
            if (front_known && i < to) front_inside = false;
        }
    }
    if (ends_ray(cut)) hit = enters ? ray.enter : MISS;
    vec4 rgba = developed(colour, opacity, pixel, imageSize(picture));
    // What is lit later is lit without its face.
    imageStore(picture, pixel, PART == HIT ? rgba : capped(cut, rgba));
    if (PART == HIT) imageStore(hit_distance, pixel, vec4(hit, 0.0, 0.0, 0.0));
}
