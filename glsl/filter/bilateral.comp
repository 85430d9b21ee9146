// Gaussian in position and in distance (Tomasi and Manduchi 1998). A miss stays a miss and has no weight, so that no edge is
// created or moved. An invocation makes four vertically adjacent pixels, whose windows share most of their texels.
// variants: distance DISTANCE
#version 460
layout(constant_id = 0) const int RADIUS = 8;
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
layout(scalar) uniform Params {
    float place_narrowness;    // 1 / (2 sigma^2), 1/pixel^2
    float distance_narrowness; // 1 / (2 sigma^2), 1/mm^2
    int slice;
};
#include "filter.glsl"

const int RUN = 4;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    at.y *= RUN;
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    ivec2 last = size.xy - 1;
    float centre[RUN], sum[RUN] = float[RUN](0.0, 0.0, 0.0, 0.0), weight[RUN] = sum;
    bool hit = false;
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        centre[i] = read_at(ivec3(at.x, min(at.y + i, last.y), at.z));
        hit = hit || VALID(centre[i]);
    }
    // exp is computed from exp2.
    const float LOG2_E = 1.442695041;
    float place_fall = -LOG2_E * place_narrowness, distance_fall = -LOG2_E * distance_narrowness;
    int top = max(at.y - RADIUS, 0), bottom = min(at.y + RUN - 1 + RADIUS, last.y);
    for (int y = top; hit && y <= bottom; ++y) {
        float row_sum[RUN] = float[RUN](0.0, 0.0, 0.0, 0.0), row_weight[RUN] = row_sum;
        [[unroll]] for (int x = -RADIUS; x <= RADIUS; ++x) {
            int column = clamp(at.x + x, 0, last.x);
            float value = read_at(ivec3(column, y, at.z));
            bool is_there = column == at.x + x && VALID(value);
            value = is_there ? value : 0.0;
            float place = is_there ? float(x * x) * place_fall : -1e4;
            [[unroll]] for (int i = 0; i < RUN; ++i) {
                float away = value - centre[i];
                float w = exp2(away * away * distance_fall + place);
                row_sum[i] += w * away;
                row_weight[i] += w;
            }
        }
        [[unroll]] for (int i = 0; i < RUN; ++i) {
            float below = float(y - at.y - i);
            float part = abs(below) <= float(RADIUS) ? exp2(below * below * place_fall) : 0.0;
            sum[i] += part * row_sum[i];
            weight[i] += part * row_weight[i];
        }
    }
    [[unroll]] for (int i = 0; i < RUN; ++i) {
        if (at.y + i > last.y) break;
        write_at(at + ivec3(0, i, 0), VALID(centre[i]) ? centre[i] + sum[i] / weight[i] : centre[i]);
    }
}
