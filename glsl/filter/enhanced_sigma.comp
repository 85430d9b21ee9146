// The sigma filter with a growing window (thesis 5.4, 5.5): while fewer pixels than the starting window holds are within the
// range of the estimated centre, the window grows by one on every side. Colours are compared by their brightness. A miss stays
// a miss and is ignored elsewhere.
// variants: slice; distance DISTANCE; picture PICTURE
#version 460
layout(constant_id = 0) const int RADIUS = 2;  // of the starting window
layout(constant_id = 1) const int MAX_RADIUS = 9;
layout(constant_id = 2) const int ESTIMATOR = 0;
layout(constant_id = 3) const int MULTIPLICATIVE = 0; // the range is a share of the centre
layout(constant_id = 4) const int GROWTH = 0;         // 1: the result is the number of rings that the window grew
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
    float range; // 2 sigma, at most 1e30
    float few;   // K
    float edge;  // k of a Perona-Malik centre
    float least; // smallest difference that a gradient-inverse centre distinguishes
#include "slice_params.glsl"
};
#include "filter.glsl"

#ifdef PICTURE
float brightness(T value) { return dot(value.rgb, vec3(0.2126, 0.7152, 0.0722)); }
#else
float brightness(T value) { return value; }
#endif
float level(ivec2 at) { return brightness(read_at(ivec3(at, 0))); }
#include "estimators.glsl"

void main() {
    ivec3 at = made_texel();
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    ivec2 last = size.xy - 1;
    T here = read_at(at);
    if (!VALID(here)) {
        write_at(at, here);
        return;
    }
    float centre = estimate(at.xy, last);
    float within = MULTIPLICATIVE != 0 ? range * abs(centre) : range;
    // Sums of differences from the pixel: a distance of 100 mm keeps its micrometres in f32.
    T sum = T(0.0);
    float count = 0.0, start_count = 0.0;
    int rings = 0;
    for (int r = 0; r <= MAX_RADIUS; ++r) {
        // The complete starting window, then one ring at a time until enough pixels are within the range.
        if (r > RADIUS && count >= start_count) break;
        rings = max(r - RADIUS, 0);
        for (int i = 0; i < max(8 * r, 1); ++i) {
            // Around the ring of radius r: four sides of 2r pixels.
            int side = r > 0 ? i / (2 * r) : 0, along = r > 0 ? i % (2 * r) : 0;
            ivec2 away = side == 0 ? ivec2(along - r, -r) : side == 1 ? ivec2(r, along - r) : side == 2 ? ivec2(r - along, r) : ivec2(-r, r - along);
            ivec2 tap = at.xy + away;
            if (any(lessThan(tap, ivec2(0))) || any(greaterThan(tap, last))) continue;
            T value = read_at(ivec3(tap, 0));
            if (!VALID(value)) continue;
            float inside = abs(brightness(value) - centre) <= within ? 1.0 : 0.0;
            sum += inside * (value - here);
            count += inside;
            start_count += r <= RADIUS ? 1.0 : 0.0;
        }
    }
    if (GROWTH == 1) {
        write_at(at, T(rings));
        return;
    }
    T result = sum / max(count, 1.0);
    // Near the border fewer pixels exist: all of them are enough.
    if (count <= min(few, start_count - 1.0)) {
        sum = T(0.0);
        count = 0.0;
        for (int i = 0; i < 4; ++i) {
            ivec2 tap = at.xy + ivec2((i & 1) * (i - 2), (1 - (i & 1)) * (i - 1));
            if (any(lessThan(tap, ivec2(0))) || any(greaterThan(tap, last))) continue;
            T value = read_at(ivec3(tap, 0));
            if (!VALID(value)) continue;
            sum += value - here;
            count += 1.0;
        }
        result = sum / max(count, 1.0);
    }
    write_at(at, here + result);
}
