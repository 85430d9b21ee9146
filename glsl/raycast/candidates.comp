// The two edges of each ray that are most likely its surface, for passes that choose among those of neighbouring rays. An edge is as likely as
// the echo that lasts behind it is above the echo in front of it: over two lengths of an edge behind, over the detector's memory in front. That
// tells a wall from noise better than the difference of the ring does, which only finds the edge and its place.
#version 460
#include "common.glsl"
#extension GL_KHR_shader_subgroup_vote : require
layout(scalar) uniform Params {
#include "ray_params.glsl"
#include "surface_params.glsl"
    float weak_contrast; // edges up to this contrast are as unlikely as any
    float weight_density; // weight of a contrast above that; an edge of weight 1 is certain
};
#include "ray.glsl"
#include "sliding.glsl"
#include "detector.glsl"
#include "empty_space.glsl"
uniform writeonly image2D candidates; // places along the ray, mm, nearest first; their weights

// The first two in order of depth, MISS where there is none, and their weights.
vec4 kept = vec4(MISS, MISS, 0.0, 0.0);
float level = 0.0;    // mean echo in front of the edge
float contrast = 0.0; // of the mean echo behind it
int certain_at = NEVER;   // the first edge that is certain
// Of the last that was kept.
float kept_best = 0.0;
int kept_at = -RING;

Ray aimed(Ray ray, int i) { return ray; }

// As in the march of the other detectors, the ring is filled in front of the region and may reach behind it. What outgrows an edge that is certain is
// still found.
int complete = 0; // steps on the ray
bool is_in_reach(int i) { return i - HALF - RING < complete && i - HALF - RING <= certain_at; }

void begin_peak(float difference, int i) {
    best = difference;
    best_at = i;
    before = filled > RING ? previous : difference;
    level = noise_mean;
}

// Noise in front of a wall has the wall's contrast: an edge that the next one exceeds by this factor within a ring is a part of that.
const float OUTGROWN = 1.5;

// Keeps an edge in place of one that is less likely.
void keep(Ray ray) {
    float at = offset_of(ray, surface_place(0.0) + SAMPLE_AT);
    if (contrast > 0.0 && at >= 0.0 && at <= ray.leave - ray.enter) {
        float weight = clamp((contrast - weak_contrast) * weight_density, 0.0, 1.0), place = ray.enter + at;
        bool is_second = is_hit(kept.y);
        bool replaces = best_at - kept_at < RING && best > OUTGROWN * kept_best && weight >= (is_second ? kept.w : kept.z);
        bool is_kept = replaces || !is_second || weight > min(kept.z, kept.w);
        if (!is_hit(kept.x) || (replaces && !is_second)) {
            kept.xz = vec2(place, weight);
        } else if (is_kept) {
            if (is_second && !replaces && kept.z <= kept.w) kept.xz = kept.yw;
            kept.yw = vec2(place, weight);
        }
        if (is_kept) {
            kept_best = best;
            kept_at = best_at;
        }
        if (weight >= 1.0) certain_at = min(certain_at, best_at);
    }
}

// After sample i made the ring full or kept it full.
void follow_edge(Ray ray, float difference, int i) {
    learn();
    if (state == SEARCH_FINE) {
        if (difference > threshold && i >= HALF && (filled == RING || difference > previous)) {
            state = FOLLOW;
            fired = i;
            begin_peak(difference, i);
        }
    } else {
        if (i == best_at + 1) after = difference;
        if (i == best_at + HALF) contrast = polarity * (0.5 * (newer_mean() + older_mean()) - level);
        if (state == FOLLOW) {
            if (difference < FOLLOW_LEVEL * best || i >= fired + FOLLOW_LENGTH) state = FOLLOWED;
            else if (difference > best) begin_peak(difference, i);
        }
        if (state == FOLLOWED && i >= best_at + HALF) {
            keep(ray);
            state = SEARCH_FINE;
        }
    }
}

void main() {
    ivec2 pixel = ray_pixel();
    if (any(greaterThanEqual(pixel, imageSize(candidates)))) return;
    Slices slices = no_slices();
    Ray ray = ray_of(pixel);
    complete = ray.leave > ray.enter ? int(steps_to(ray, ray.leave - ray.enter)) : 0;
    int i = complete > 0 ? max(-HALF, int(ceil(steps_to(ray, -ray.enter) - 0.5))) : NEVER;
    do {
        if (SKIP == 1) {
            for (bool skips = is_in_reach(i); skips;) {
                RaySegment here = segment_at(ray, i, SAMPLE_AT);
                skips = here.kind == EMPTY;
                if (skips) {
                    // The same as if each sample were outside.
                    i = here.stop;
                    restart(i);
                    skips = is_in_reach(i);
                }
            }
        }
        for (int n = SAMPLES_PER_LOOKUP; n > 0 && is_in_reach(i); --n) {
            vec3 texel;
            if (locate(place_at(ray, offset_of(ray, float(i) + SAMPLE_AT)), texel)) {
                float difference = push_sample(sample_along(ray, i, SAMPLE_AT, texel, slices));
                if (filled >= RING) follow_edge(ray, difference, i);
                previous = difference;
            } else {
                restart(i + 1);
            }
            ++i;
        }
        if (!is_in_reach(i)) i = NEVER;
    } while (subgroupAny(i < NEVER));
    imageStore(candidates, pixel, kept);
}
