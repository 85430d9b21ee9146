// Gaussian in place and in distance (Tomasi and Manduchi 1998). A miss stays a miss and weighs nothing, so no edge is
// drawn or moved.
// variants: distance DISTANCE
#version 460
layout(constant_id = 0) const int RADIUS = 8;
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
    float place_narrowness;    // 1 / (2 sigma^2), 1/pixel^2
    float distance_narrowness; // 1 / (2 sigma^2), 1/mm^2
    int slice;
};
#include "filter.glsl"

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    float centre = read_at(at);
    if (!VALID(centre)) {
        write_at(at, centre);
        return;
    }
    float sum = 0.0, weight = 0.0;
    ivec2 low = max(at.xy - RADIUS, ivec2(0)), high = min(at.xy + RADIUS, size.xy - 1);
    for (int y = low.y; y <= high.y; ++y) {
        for (int x = low.x; x <= high.x; ++x) {
            float value = read_at(ivec3(x, y, at.z));
            if (!VALID(value)) continue;
            float away = value - centre;
            vec2 place = vec2(ivec2(x, y) - at.xy);
            float w = exp(-dot(place, place) * place_narrowness - away * away * distance_narrowness);
            sum += w * away;
            weight += w;
        }
    }
    write_at(at, centre + sum / weight);
}
