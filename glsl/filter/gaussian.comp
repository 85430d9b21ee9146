// One axis of a separable Gaussian. Taps beyond the border are omitted and the weights renormalised: the border of the volume, since
// all slices that a visible one needs are stored. The sharpening kernel repeats the border instead, as samples of the volume do. An
// invocation makes adjacent texels along the axis, which share most taps.
#version 460
layout(constant_id = 0) const int RADIUS = 3; // at most 96
layout(constant_id = 1) const int AXIS = 0; // 2: across the slices of a volume; otherwise within those of a batch
layout(constant_id = 2) const int SHARPENS = 0; // 1: (-1, 8, -1)/6 in place of the Gaussian, against the blur of the cubic B-spline between slices
layout(constant_id = 3) const int TILED = 0; // 1: a workgroup reads its texels once into shared memory, along axis 0
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_control_flow_attributes : require
layout(scalar) uniform Params {
#include "slice_params.glsl"
    int slices; // those that are made, from `slice` on
    float weights[97]; // of a tap, by its distance in texels; of all taps together 1
};
#define SOURCE_3D
#include "filter.glsl"

const int RUN = 8;
// Along a row, invocations read and make texels a run apart, which a GPU would load and store one by one: it does so through the tile, where a gap
// after each run and this pitch keep 8 x 4 invocations in 32 banks.
const int TILE_COLUMNS = 8 * RUN + 2 * RADIUS, TILE_ROWS = 8;
const int TILE_GAP = RUN, TILE_PITCH = (TILE_COLUMNS + TILE_COLUMNS / RUN + 7) / 16 * 16 + 8;
#include "workgroup_tile.glsl"

ivec3 size; // of what is seen; of what is made, where that ends sooner

// 0 beyond the border of the volume.
float value_at(ivec3 tap) {
    int length = source_size()[AXIS];
    bool inside = SHARPENS == 1 || uint(tap[AXIS]) < uint(length);
    // What is further away than a texel to make can see may be on its way still.
    int along = clamp(tap[AXIS], 0, min(length, size[AXIS] + RADIUS) - 1);
    // A workgroup also reads where its invocations make nothing.
    if (TILED == 1) tap = min(tap, size - 1);
    tap[AXIS] = along;
    float value = read_at(tap);
    return inside ? value : 0.0;
}

void main() {
    ivec3 at = made_run(AXIS, RUN);
    size = source_size();
    int length = size[AXIS];
    // Of a volume, source and target begin with its first stored texel.
    ivec3 to_target = place_in_target(ivec3(0));
    if (AXIS == 2) {
        at += to_target;
        size.z = min(size.z, slice + slices - first_stored_slice);
        to_target = ivec3(0);
    } else {
        // A rectangle may end within a workgroup.
        size.xy = min(size.xy, ivec2(end_column, end_row));
    }
    ivec2 here = ivec2(gl_LocalInvocationID.xy);
    if (TILED == 1) {
        ivec3 first = at - ivec3(here.x * RUN + RADIUS, here.y, 0);
        FILL_TILE(first, value_at)
    } else if (any(greaterThanEqual(at, size))) {
        return;
    }
    float sums[RUN];
    [[unroll]] for (int n = 0; n < RUN; ++n) sums[n] = 0.0;
    [[unroll]] for (int i = -RADIUS; i < RUN + RADIUS; ++i) {
        ivec3 tap = at;
        tap[AXIS] += i;
        float value = TILED == 1 ? tile[tile_place(here.x * RUN + RADIUS + i, here.y)] : value_at(tap);
        [[unroll]] for (int n = 0; n < RUN; ++n) {
            if (abs(i - n) <= RADIUS) sums[n] += weights[abs(i - n)] * value;
        }
    }
    // Only at a border taps are missing. A loop costs a software device one turn elsewhere, a branch all of it.
    float there[RUN];
    [[unroll]] for (int n = 0; n < RUN; ++n) there[n] = 1.0;
    int nearest = min(at[AXIS], length - RUN - at[AXIS]);
    for (int k = SHARPENS == 1 ? RADIUS + 1 : max(nearest, 0) + 1; k <= RADIUS; ++k) {
        [[unroll]] for (int n = 0; n < RUN; ++n) {
            there[n] -= (k > at[AXIS] + n ? weights[k] : 0.0) + (k >= length - at[AXIS] - n ? weights[k] : 0.0);
        }
    }
    // All have read what is replaced.
    if (TILED == 1) barrier();
    ivec3 to = at;
    [[unroll]] for (int n = 0; n < RUN; ++n) {
        float mean = SHARPENS == 1 ? clamp(sums[n], 0.0, 1.0) : sums[n] / there[n];
        if (TILED == 1) {
            tile[tile_place(here.x * RUN + n, here.y)] = mean;
        } else if (to[AXIS] < size[AXIS]) {
            imageStore(target, to + to_target, STORED(mean));
        }
        ++to[AXIS];
    }
    if (TILED == 0) return;
    barrier();
    at.x -= here.x * (RUN - 1);
    [[unroll]] for (int n = 0; n < RUN; ++n) {
        if (all(lessThan(at, size))) imageStore(target, at + to_target, STORED(tile[tile_place(here.x + 8 * n, here.y)]));
        at.x += 8;
    }
}
