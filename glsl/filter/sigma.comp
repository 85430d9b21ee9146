// Lee's sigma filter: the mean of the neighbours within `range` of the centre. Where at most `few` are, and not all that exist,
// the mean of the four immediate neighbours. (Lee 1983; thesis 5.3.) An invocation makes four vertically adjacent pixels, whose
// windows share most of their texels; of colours two, because four take twice the registers.
// variants: slice; distance DISTANCE; picture PICTURE
#version 460
layout(constant_id = 0) const int RADIUS = 3;
layout(constant_id = 1) const int MULTIPLICATIVE = 0; // the range is a share of the centre
#if defined(DISTANCE) || defined(PICTURE)
const int TILED = 0;
#else
layout(constant_id = 2) const int TILED = 0; // 1: a workgroup reads its texels once into shared memory
#endif
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
layout(scalar) uniform Params {
    float range; // 2 sigma, at most 1e30
    float tie;   // added to the range: a value at its end is within it, however it is rounded
    float few;   // K
#include "slice_params.glsl"
};
#include "filter.glsl"

#ifdef PICTURE
const int RUN = 2;
#define SCARCE(count, enough) any(lessThanEqual(count, vec4(enough)))
#define ADD_IF_CLOSE(sum, count, away, within) { \
    bvec4 is_close = lessThanEqual(abs(away), within); \
    sum += mix(vec4(0.0), away, is_close); \
    count += mix(vec4(0.0), vec4(1.0), is_close); \
}
#else
const int RUN = 4;
#define SCARCE(count, enough) ((count) <= (enough))
// As a factor: a GPU compares and selects at half the rate that it multiplies and adds at. Of colours it would take more registers.
#define ADD_IF_CLOSE(sum, count, away, within) { \
    float is_close = float(abs(away) <= (within)); \
    sum += is_close * (away); \
    count += is_close; \
}
#endif

#if defined(DISTANCE) || defined(PICTURE)
#define VALUE_AT(column, row) read_at(ivec3(column, row, at.z))
#else
const int TILE_COLUMNS = 8 + 2 * RADIUS, TILE_ROWS = 8 * RUN + 2 * RADIUS;
// Invocations read four rows apart: with this pitch 8 x 4 of them read from 32 banks.
const int TILE_GAP = 0, TILE_PITCH = (TILE_COLUMNS + 5) / 8 * 8 + 2;
#include "workgroup_tile.glsl"

// MISS, which is further from the centre than any `range`, beyond the border.
float value_at(ivec3 at) {
    ivec2 last = source_size().xy - 1;
    float value = read_at(ivec3(clamp(at.xy, ivec2(0), last), at.z));
    return any(lessThan(at.xy, ivec2(0))) || any(greaterThan(at.xy, last)) ? MISS : value;
}
#define VALUE_AT(column, row) (TILED == 1 ? tile[tile_place(column - first.x, row - first.y)] : read_at(ivec3(column, row, at.z)))
#endif

void main() {
    ivec3 at = made_run(1, RUN);
    ivec3 size = source_size();
    ivec2 last = size.xy - 1;
#if !defined(DISTANCE) && !defined(PICTURE)
    // Of the tile, whose texels all lie in it.
    ivec3 first = at - ivec3(gl_LocalInvocationID.xy * uvec2(1, RUN), 0) - ivec3(RADIUS, RADIUS, 0);
    if (TILED == 1) FILL_TILE(first, value_at)
#endif
    if (any(greaterThanEqual(at, size))) return;
    // Sums of differences from the centre: a distance of 100 mm keeps its micrometres in f32.
    T centre[RUN], within[RUN], sum[RUN], count[RUN];
    float there[RUN];
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        centre[i] = read_at(ivec3(at.x, min(at.y + i, last.y), at.z));
        within[i] = (MULTIPLICATIVE != 0 ? range * abs(centre[i]) : T(range)) + tie;
        sum[i] = count[i] = T(0.0);
        there[i] = 0.0;
    }
    int top = max(at.y - RADIUS, 0), bottom = min(at.y + RUN - 1 + RADIUS, last.y);
    for (int y = top; y <= bottom; ++y) {
        T row_sum[RUN], row_count[RUN];
        [[unroll]] for (int i = 0; i < RUN; ++i) row_sum[i] = row_count[i] = T(0.0);
        float row_there = 0.0;
        [[unroll]] for (int x = -RADIUS; x <= RADIUS; ++x) {
            int column = TILED == 1 ? at.x + x : clamp(at.x + x, 0, last.x);
            T value = VALUE_AT(column, y);
            bool is_there = uint(at.x + x) <= uint(last.x) && VALID(value);
            // Further from the centre than any `range`; in a tile it already is.
            if (TILED == 0 && !is_there) value = T(MISS);
            row_there += is_there ? 1.0 : 0.0;
            [[unroll]] for (int i = 0; i < RUN; ++i) {
                T away = value - centre[i];
                ADD_IF_CLOSE(row_sum[i], row_count[i], away, within[i])
            }
        }
        [[unroll]] for (int i = 0; i < RUN; ++i) {
            float part = abs(y - at.y - i) <= RADIUS ? 1.0 : 0.0;
            sum[i] += part * row_sum[i];
            count[i] += part * row_count[i];
            there[i] += part * row_there;
        }
    }
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        ivec3 here = at + ivec3(0, i, 0);
        if (here.y > last.y) break;
        T result = centre[i];
        if (VALID(centre[i])) {
            float enough = min(few, there[i] - 1.0);
            result += sum[i] / count[i];
            if (SCARCE(count[i], enough)) {
                T near_sum = T(0.0);
                float near_count = 0.0;
                for (int n = 0; n < 4; ++n) {
                    ivec2 next = here.xy + ivec2((n & 1) * (n - 2), (1 - (n & 1)) * (n - 1));
                    if (any(lessThan(next, ivec2(0))) || any(greaterThan(next, last))) continue;
                    T value = read_at(ivec3(next, at.z));
                    if (!VALID(value)) continue;
                    near_sum += value - centre[i];
                    near_count += 1.0;
                }
                T neighbours = near_count > 0.0 ? near_sum / near_count : T(0.0);
#ifdef PICTURE
                result = mix(result, centre[i] + neighbours, lessThanEqual(count[i], vec4(enough)));
#else
                result = centre[i] + neighbours;
#endif
            }
        }
        write_at(here, result);
    }
}
