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
    float tie;   // added to the range: a value at its end is within it, however it is rounded
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

// Sum and number of the texels whose brightness is within the range of the centre, and of all that are there. The sum is of differences
// from the pixel: a distance of 100 mm keeps its micrometres in f32.
T here, sum = T(0.0);
float centre, within, count = 0.0, there = 0.0;

// Adds the texel at `place` if it is there.
void add(ivec2 place, ivec2 last, bool is_there) {
    T value = read_at(ivec3(clamp(place, ivec2(0), last), 0));
    is_there = is_there && VALID(value);
    float inside = is_there && abs(brightness(value) - centre) <= within ? 1.0 : 0.0;
    sum += inside * (value - here);
    count += inside;
    there += is_there ? 1.0 : 0.0;
}

void main() {
    ivec3 at = made_texel();
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    ivec2 last = size.xy - 1;
    here = read_at(at);
    if (!VALID(here)) {
        write_at(at, here);
        return;
    }
    centre = estimate(at.xy, last);
    within = (MULTIPLICATIVE != 0 ? range * abs(centre) : range) + tie;
    for (int y = at.y - RADIUS; y <= at.y + RADIUS; ++y) {
        bool has_row = uint(y) <= uint(last.y);
        for (int x = at.x - RADIUS; x <= at.x + RADIUS; ++x) add(ivec2(x, y), last, has_row && uint(x) <= uint(last.x));
    }
    // One ring at a time until as many texels are within the range as the starting window has.
    float start_count = there;
    int rings = 0;
    for (; rings < MAX_RADIUS - RADIUS && count < start_count; ++rings) {
        int r = RADIUS + 1 + rings;
        ivec2 low = at.xy - r, high = at.xy + r;
        bvec2 has_low = greaterThanEqual(low, ivec2(0)), has_high = lessThanEqual(high, last);
        // A texel of each side at once, all the way around.
        for (int k = 0; k < 2 * r; ++k) {
            ivec2 onwards = low + k, back = high - k;
            add(ivec2(onwards.x, low.y), last, has_low.y && uint(onwards.x) <= uint(last.x));
            add(ivec2(high.x, onwards.y), last, has_high.x && uint(onwards.y) <= uint(last.y));
            add(ivec2(back.x, high.y), last, has_high.y && uint(back.x) <= uint(last.x));
            add(ivec2(low.x, back.y), last, has_low.x && uint(back.y) <= uint(last.y));
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
