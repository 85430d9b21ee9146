// One axis of a separable Gaussian. Taps beyond the border are omitted and the weights renormalised: the border of the volume, since
// all slices that a visible one needs are stored. The sharpening kernel repeats the border instead, as samples of the volume do. An
// invocation makes four adjacent texels along the axis and passes their taps through registers.
#version 460
layout(constant_id = 0) const int RADIUS = 3;
layout(constant_id = 1) const int AXIS = 0; // 2: across the slices of a volume; otherwise within those of a batch
layout(constant_id = 2) const int SHARPENS = 0; // 1: (-1, 8, -1)/6 in place of the Gaussian, against the blur of the cubic B-spline between slices
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
layout(scalar) uniform Params {
    float narrowness; // 1 / (2 sigma^2), 1/texel^2
#include "slice_params.glsl"
    int slices; // those that are made, from `slice` on
};
#define SOURCE_3D
#include "filter.glsl"

const int RUN = 4;

void main() {
    ivec3 at = made_run(AXIS, RUN);
    ivec3 size = source_size();
    // Of a volume, source and target begin with its first stored texel.
    ivec3 to_target = place_in_target(ivec3(0));
    if (AXIS == 2) {
        at += to_target;
        size.z = min(size.z, slice + slices - first_stored_slice);
        to_target = ivec3(0);
    }
    if (any(greaterThanEqual(at, size))) return;
    int length = source_size()[AXIS];
    vec4 sum = vec4(0.0), weight = vec4(0.0);
    // The taps at offset i from each of the four, and 1 where they exist.
    vec4 taps = vec4(0.0), there = vec4(0.0);
    [[unroll]] for (int i = -RADIUS - RUN + 1; i <= RADIUS; ++i) {
        ivec3 tap = at;
        tap[AXIS] += i + RUN - 1;
        bool inside = SHARPENS == 1 || (tap[AXIS] >= 0 && tap[AXIS] < length);
        tap[AXIS] = clamp(tap[AXIS], 0, min(length, size[AXIS] + RADIUS) - 1);
        float value = read_at(tap);
        taps = vec4(taps.yzw, inside ? value : 0.0);
        there = vec4(there.yzw, inside ? 1.0 : 0.0);
        float bell = SHARPENS == 1 ? (i == 0 ? 8.0 / 6.0 : -1.0 / 6.0) : exp(-float(i * i) * narrowness);
        float w = i < -RADIUS ? 0.0 : bell;
        sum += w * taps;
        weight += w * there;
    }
    vec4 mean = SHARPENS == 1 ? clamp(sum, 0.0, 1.0) : sum / weight;
    for (int i = 0; i < RUN && at[AXIS] < size[AXIS]; ++i) {
        imageStore(target, at + to_target, STORED(mean[i]));
        ++at[AXIS];
    }
}
