// Median of a square window; beyond the border the nearest pixel repeats. For distances, where more pixels are hits than misses,
// the (lower) median of the hits: this closes pinholes and draws no rim towards a miss. An invocation makes four vertically
// adjacent pixels, whose windows share most of their texels.
// variants: slice; distance DISTANCE
#version 460
#ifdef DISTANCE
layout(constant_id = 0) const int RADIUS = 7;
#endif
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
layout(scalar) uniform Params {
#include "slice_params.glsl"
};
#include "filter.glsl"

const int RUN = 4;
float tap(ivec2 at, ivec2 last) { return read_at(ivec3(clamp(at, ivec2(0), last), 0)); }

#ifdef DISTANCE
#include "median.glsl"
#else
vec3 sorted(vec3 v) {
    float low = min(v.x, v.y), high = max(v.x, v.y), rest = max(low, v.z);
    return vec3(min(low, v.z), min(high, rest), max(high, rest));
}

// Medians of 3x3 from sorted rows: the median of the largest minimum, the middle median and the smallest maximum.
vec4 medians(ivec2 at, ivec2 last) {
    vec3 row[RUN + 2];
    for (int y = 0; y < RUN + 2; ++y) {
        ivec2 tap_at = at + ivec2(0, y - 1);
        row[y] = sorted(vec3(tap(tap_at - ivec2(1, 0), last), tap(tap_at, last), tap(tap_at + ivec2(1, 0), last)));
    }
    vec4 found;
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        vec3 a = row[i], b = row[i + 1], c = row[i + 2];
        float least = max(max(a.x, b.x), c.x), most = min(min(a.z, b.z), c.z);
        float middle = max(min(a.y, b.y), min(max(a.y, b.y), c.y));
        found[i] = max(min(least, middle), min(max(least, middle), most));
    }
    return found;
}
#endif

void main() {
    ivec3 at = made_run(1, RUN);
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    ivec2 last = size.xy - 1;
    vec4 found = medians(at.xy, last);
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        if (at.y + i <= last.y) write_at(at + ivec3(0, i, 0), found[i]);
    }
}
