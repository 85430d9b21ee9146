// The largest, the smallest, or the mean of the samples that each ray meets within the insonified region.
// variants: plain; even SWEPT; moved SWEPT MOVED; uneven SWEPT UNEVEN; uneven_moved SWEPT UNEVEN MOVED
#version 460
#include "common.glsl"
layout(constant_id = 3) const int KEPT = 0; // 0 largest, 1 smallest, 2 mean
layout(scalar) uniform Params {
#include "ray_params.glsl"
};
#include "ray.glsl"
#include "sliding.glsl"
#include "skip.glsl"
uniform writeonly image2D picture;

// Whether no sample of a stretch can be kept.
bool below(Stretch s, float kept) {
    bool nothing = s.range.x > s.range.y;
    // A weighted mean may lie beyond its texels by rounding.
    const float beyond = SLIDING > 0 ? 1.00001 : 1.0;
    return nothing || (KEPT == 0 ? windowed(s.range.y * beyond) + 1e-6 <= kept : windowed(s.range.x / beyond) - 1e-6 >= kept);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    Ray ray = ray_of(pixel);
    float path = ray.leave - ray.enter;
    // Beyond all values, so that the first one is taken.
    float kept = KEPT == 0 ? -1.0 : KEPT == 1 ? 2.0 : 0.0;
    float met = 0.0;    // mm within the region
    int met_whole = 0;  // whole even steps, as a number: what is leapt over counts the same
    if (path > 0.0) {
        Slices slices = no_slices();
        int whole = int(steps_to(ray, path)) + SPREAD;
        // The last steps are not what their numbers say: they are taken in any case.
        int last = whole - 1 - SPREAD;
        // Sums of 64 samples first: one sum of 65536 would lose four of f32's seven digits.
        float some = 0.0, some_met = 0.0;
        for (int i = 0; i <= whole;) {
            int stop = whole + 1;
            if (SKIP > 0) {
                Stretch here = stretch_at(ray, i, SAMPLE_AT);
                while (i < last && (SKIP == 2 ? below(here, kept) : here.kind == NOTHING || (here.kind == KNOWN && SPREAD == 0))) {
                    int to = min(here.stop, last);
                    if (KEPT == 2 && here.kind == KNOWN) {
                        // Zeros.
                        met_whole += to - i;
                        if (to >> 6 != i >> 6) {
                            kept += some;
                            some = 0.0;
                        }
                    }
                    i = to;
                    here = stretch_at(ray, i, SAMPLE_AT);
                }
                if (i < last) stop = min(stop, i + BLOCK);
            }
            for (; i < stop; ++i) {
                float from = offset_of(ray, float(i));
                float length = min(length_of(ray, float(i)), path - from);
                vec3 texel;
                // No short circuit: a place that need not be known costs less than a branch about it.
                bool inside = locate(ray.origin + ray.direction * (ray.enter + from + 0.5 * length), texel);
                if (length <= 0.0 || !inside) continue;
                float value = sample_along(ray, i, SAMPLE_AT, texel, slices);
                if (KEPT == 2) {
                    some += value * length;
                    if (SPREAD == 0 && i < whole) ++met_whole;
                    else some_met += length;
                    if ((i & 63) == 63) {
                        kept += some;
                        met += some_met;
                        some = 0.0;
                        some_met = 0.0;
                    }
                } else {
                    kept = KEPT == 0 ? max(kept, value) : min(kept, value);
                    met = 1.0;
                    // Nothing can go beyond the window's ends.
                    if (kept == (KEPT == 0 ? 1.0 : 0.0)) whole = stop = -1;
                }
            }
        }
        kept += some;
        met += some_met + float(met_whole) * step_length;
    }
    float value = KEPT == 2 ? kept / max(met, 1e-20) : kept;
    imageStore(picture, pixel, met > 0.0 ? vec4(vec3(value), 1.0) : vec4(0.0));
}
