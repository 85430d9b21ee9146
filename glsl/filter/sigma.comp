// Lee's sigma filter: the mean of the neighbours within `range` of the centre; where no more than `few` are, nor all that
// there are, the mean of the four immediate neighbours. (Lee 1983; thesis 5.3.)
// variants: plane; slice SLICE; distance DISTANCE; picture PICTURE
#version 460
layout(constant_id = 0) const int RADIUS = 3;
layout(constant_id = 1) const int MULTIPLICATIVE = 0; // the range is a share of the centre
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
    float range; // 2 sigma, at most 1e30
    float few;   // K
#include "slice_params.glsl"
};
#include "filter.glsl"

void main() {
    ivec3 at = made_texel();
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    T centre = read_at(at);
    if (!VALID(centre)) {
        write_at(at, centre);
        return;
    }
    T within = MULTIPLICATIVE != 0 ? range * abs(centre) : T(range);
    // Sums of differences from the centre: a distance of 100 mm keeps its micrometres in f32.
    T sum = T(0.0);
    T count = T(0.0);
    float there = 0.0;
    ivec2 low = max(at.xy - RADIUS, ivec2(0)), high = min(at.xy + RADIUS, size.xy - 1);
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            T away = read_at(ivec3(x, y, at.z)) - centre;
            T inside = WITHIN(away, within);
            bool valid = VALID(away + centre);
            if (!valid) inside = T(0.0);
            there += valid ? 1.0 : 0.0;
            sum += inside * min(away, within);
            count += inside;
        }
    }
    T near_sum = T(0.0);
    float near_count = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 next = at.xy + ivec2((i & 1) * (i - 2), (1 - (i & 1)) * (i - 1));
        if (any(lessThan(next, ivec2(0))) || any(greaterThanEqual(next, size.xy))) continue;
        T value = read_at(ivec3(next, at.z));
        if (!VALID(value)) continue;
        near_sum += value - centre;
        near_count += 1.0;
    }
    T mean = sum / count;
    T neighbours = near_count > 0.0 ? near_sum / near_count : T(0.0);
#ifdef PICTURE
    write_at(at, centre + mix(mean, neighbours, lessThanEqual(count, vec4(min(few, there - 1.0)))));
#else
    write_at(at, centre + (count <= min(few, there - 1.0) ? neighbours : mean));
#endif
}
