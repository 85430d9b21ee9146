// The sigma filter with a growing window (thesis 5.4, 5.5): while fewer pixels than the starting window holds lie within the
// range of the estimated centre, the window grows by one on every side. Colours go by their brightness.
// variants: picture PICTURE
#version 460
layout(constant_id = 0) const int RADIUS = 2;  // to start with
layout(constant_id = 1) const int LARGEST = 9;
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
    float range; // 2 sigma
    float few;   // K
    int slice;
};
#include "filter.glsl"

float brightness(T value) { return dot(value.rgb, vec3(0.2126, 0.7152, 0.0722)); }

// Median of 3x3 brightnesses; beyond the border the nearest pixel stands in.
float centre_of(ivec2 at, ivec2 last) {
    float v[9];
    for (int i = 0; i < 9; ++i) v[i] = brightness(read_at(ivec3(clamp(at + ivec2(i % 3 - 1, i / 3 - 1), ivec2(0), last), 0)));
    // Five rounds of bubbling bring the fifth largest to its place.
    for (int round = 0; round < 5; ++round) {
        for (int i = 0; i < 8 - round; ++i) {
            float low = min(v[i], v[i + 1]), high = max(v[i], v[i + 1]);
            v[i] = low;
            v[i + 1] = high;
        }
    }
    return v[4];
}

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    ivec2 last = size.xy - 1;
    float centre = centre_of(at.xy, last);
    ivec2 low = max(at.xy - RADIUS, ivec2(0)), high = min(at.xy + RADIUS, last);
    float wanted = float((high.x - low.x + 1) * (high.y - low.y + 1));
    T sum = T(0.0);
    float count = 0.0;
    for (int r = 0; r <= LARGEST; ++r) {
        // The starting window whole, then a ring at a time: whoever has enough is done.
        if (r > RADIUS && count >= wanted) break;
        for (int i = 0; i < max(8 * r, 1); ++i) {
            // Round the ring of radius r: four sides of 2r pixels.
            int side = r > 0 ? i / (2 * r) : 0, along = r > 0 ? i % (2 * r) : 0;
            ivec2 away = side == 0 ? ivec2(along - r, -r) : side == 1 ? ivec2(r, along - r) : side == 2 ? ivec2(r - along, r) : ivec2(-r, r - along);
            ivec2 tap = at.xy + away;
            if (any(lessThan(tap, ivec2(0))) || any(greaterThan(tap, last))) continue;
            T value = read_at(ivec3(tap, 0));
            float inside = abs(brightness(value) - centre) <= range ? 1.0 : 0.0;
            sum += inside * value;
            count += inside;
        }
    }
    T result = sum / max(count, 1.0);
    if (count <= few) {
        sum = T(0.0);
        count = 0.0;
        for (int i = 0; i < 4; ++i) {
            ivec2 tap = at.xy + ivec2((i & 1) * (i - 2), (1 - (i & 1)) * (i - 1));
            if (any(lessThan(tap, ivec2(0))) || any(greaterThan(tap, last))) continue;
            sum += read_at(ivec3(tap, 0));
            count += 1.0;
        }
        result = count > 0.0 ? sum / count : read_at(at);
    }
    write_at(at, result);
}
