// The largest, the smallest, or the mean of the samples of each ray in the insonified region.
#version 460
#include "common.glsl"
layout(constant_id = 3) const int KEPT = 0; // 0 largest, 1 smallest, 2 mean
layout(scalar) uniform Params {
#include "ray_params.glsl"
};
#include "ray.glsl"
#include "sliding.glsl"
Ray aimed(Ray ray, int i) { return ray; }
#include "empty_space.glsl"
uniform writeonly image2D picture;

// True if no sample of a segment can be kept.
bool below(RaySegment s, float kept) {
    bool nothing = s.range.x > s.range.y;
    // Rounding may put a weighted mean beyond its texels.
    const float beyond = SLIDING > 0 || ELEVATION > 0 ? 1.00001 : 1.0;
    return nothing || (KEPT == 0 ? windowed(s.range.y * beyond) + 1e-6 <= kept : windowed(s.range.x / beyond) - 1e-6 >= kept);
}

void main() {
    ivec2 pixel = ray_pixel();
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    Ray ray = ray_of(pixel);
    float path = ray.leave - ray.enter;
    // Beyond all values, so that the first sample is taken.
    float kept = KEPT == 0 ? -1.0 : KEPT == 1 ? 2.0 : 0.0;
    float met = 0.0;    // length inside the region, mm
    int met_complete = 0;  // number of complete uniform steps, skipped ones included
    if (path > 0.0) {
        Slices slices = no_slices();
        int complete = int(steps_to(ray, path)) + SPREAD;
        // The last steps have other lengths: they are always taken.
        int last = complete - 1 - SPREAD;
        // Sums of 64 samples first: one sum of 65536 would lose four of f32's seven digits.
        float partial = 0.0, partial_met = 0.0;
        for (int i = 0; i <= complete;) {
            int stop = complete + 1;
            if (SKIP > 0) {
                RaySegment here = segment_at(ray, i, SAMPLE_AT);
                while (i < last && (SKIP == 2 ? below(here, kept) : here.kind == EMPTY || (here.kind == HOMOGENEOUS && SPREAD == 0))) {
                    int to = min(here.stop, last);
                    if (KEPT == 2 && here.kind == HOMOGENEOUS) {
                        // Zeros.
                        met_complete += to - i;
                        if (to >> 6 != i >> 6) {
                            kept += partial;
                            partial = 0.0;
                        }
                    }
                    i = to;
                    here = segment_at(ray, i, SAMPLE_AT);
                }
                if (i < last) stop = min(stop, i + SAMPLES_PER_LOOKUP);
            }
            for (; i < stop; ++i) {
                float from = offset_of(ray, float(i));
                float length = min(length_of(ray, float(i)), path - from);
                vec3 texel;
                // No short circuit: an unnecessary look-up costs less than a branch.
                bool inside = locate(ray.origin + ray.direction * (ray.enter + from + 0.5 * length), texel);
                if (length <= 0.0 || !inside) continue;
                float value = sample_along(ray, i, SAMPLE_AT, texel, slices);
                if (KEPT == 2) {
                    partial += value * length;
                    if (SPREAD == 0 && i < complete) ++met_complete;
                    else partial_met += length;
                    if ((i & 63) == 63) {
                        kept += partial;
                        met += partial_met;
                        partial = 0.0;
                        partial_met = 0.0;
                    }
                } else {
                    kept = KEPT == 0 ? max(kept, value) : min(kept, value);
                    met = 1.0;
                    // No value exceeds the ends of the window.
                    if (kept == (KEPT == 0 ? 1.0 : 0.0)) complete = stop = -1;
                }
            }
        }
        kept += partial;
        met += partial_met + float(met_complete) * step_length;
    }
    float value = KEPT == 2 ? kept / max(met, 1e-20) : kept;
    imageStore(picture, pixel, met > 0.0 ? vec4(vec3(value), 1.0) : vec4(0.0));
}
