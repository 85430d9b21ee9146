// One axis of a separable Gaussian. Taps beyond the border are left out and the rest renormalised. An invocation makes four texels
// in a row along the axis, whose taps slide through registers.
// variants: plane; slice SLICE; volume VOLUME
#version 460
layout(constant_id = 0) const int RADIUS = 3;
layout(constant_id = 1) const int AXIS = 0;
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
layout(scalar) uniform Params {
    float narrowness; // 1 / (2 sigma^2), a texel
#include "slice_params.glsl"
#ifdef VOLUME
    int slices; // that are made anew, from `slice` on
#endif
};
#include "filter.glsl"

const int RUN = 4;

void main() {
    ivec3 at = made_run(AXIS, RUN);
    ivec3 size = source_size();
#ifdef VOLUME
    at.z += slice; // the first that is made anew
    size.z = min(size.z, slice + slices);
#endif
    if (any(greaterThanEqual(at, size))) return;
    int length = source_size()[AXIS];
    vec4 sum = vec4(0.0), weight = vec4(0.0);
    // The taps that are i away from each of the four, and whether they are there.
    vec4 taps = vec4(0.0), there = vec4(0.0);
    [[unroll]] for (int i = -RADIUS - RUN + 1; i <= RADIUS; ++i) {
        ivec3 tap = at;
        tap[AXIS] += i + RUN - 1;
        bool inside = tap[AXIS] >= 0 && tap[AXIS] < length;
        tap[AXIS] = clamp(tap[AXIS], 0, min(length, size[AXIS] + RADIUS) - 1);
        float value = read_at(tap);
        taps = vec4(taps.yzw, inside ? value : 0.0);
        there = vec4(there.yzw, inside ? 1.0 : 0.0);
        float w = i < -RADIUS ? 0.0 : exp(-float(i * i) * narrowness);
        sum += w * taps;
        weight += w * there;
    }
    vec4 mean = sum / weight;
    for (int i = 0; i < RUN && at[AXIS] < size[AXIS]; ++i) {
        write_at(at, mean[i]);
        ++at[AXIS];
    }
}
