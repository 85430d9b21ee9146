// Median of a square window; beyond the border the nearest pixel repeats. For distances, where more pixels are hits than misses,
// the (lower) median of the hits: this closes pinholes and draws no rim towards a miss. An invocation makes four vertically
// adjacent pixels, whose windows share most of their texels, of one column or of more.
// variants: slice; distance DISTANCE
#version 460
#ifdef DISTANCE
layout(constant_id = 0) const int RADIUS = 7;
#else
layout(constant_id = 0) const int COLUMNS = 1; // adjacent ones that an invocation makes, against loading texels more than once
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
vec3 sorted(float a, float b, float c) {
    float low = min(a, b), high = max(a, b), rest = max(low, c);
    return vec3(min(low, c), min(high, rest), max(high, rest));
}

// Of 3x3 from sorted rows: the median of the largest minimum, the middle median and the smallest maximum.
float median_of(vec3 a, vec3 b, vec3 c) {
    float least = max(max(a.x, b.x), c.x), most = min(min(a.z, b.z), c.z);
    float middle = max(min(a.y, b.y), min(max(a.y, b.y), c.y));
    return max(min(least, middle), min(max(least, middle), most));
}
#endif

#ifdef DISTANCE
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
#else
void main() {
    ivec3 at = made_run(1, RUN);
    at.x += int(gl_GlobalInvocationID.x) * (COLUMNS - 1);
    ivec3 size = source_size();
    ivec3 end = ivec3(min(size.xy, ivec2(end_column, end_row)), size.z);
    if (any(greaterThanEqual(at, end))) return;
    // All are read before any is stored: a device then waits once.
    vec3 rows[COLUMNS][RUN + 2];
    [[unroll]] for (int y = 0; y < RUN + 2; ++y) {
        float row[COLUMNS + 2];
        [[unroll]] for (int x = 0; x < COLUMNS + 2; ++x) row[x] = tap(at.xy + ivec2(x, y) - 1, size.xy - 1);
        [[unroll]] for (int x = 0; x < COLUMNS; ++x) rows[x][y] = sorted(row[x], row[x + 1], row[x + 2]);
    }
    [[unroll]] for (int y = 0; y < RUN; ++y) {
        [[unroll]] for (int x = 0; x < COLUMNS; ++x) {
            ivec3 to = at + ivec3(x, y, 0);
            if (all(lessThan(to.xy, end.xy))) write_at(to, median_of(rows[x][y], rows[x][y + 1], rows[x][y + 2]));
        }
    }
}
#endif
