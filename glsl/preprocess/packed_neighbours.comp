// Each texel of a slice with its neighbours one column and one row on, as they are stored. An interpolated sample then takes one
// load per slice. Both images hold the stored part of the volume.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int RUN = 4;    // texels per invocation
layout(constant_id = 1) const int STORED = 0; // 0 bytes, 1 16 bits of 0..1, 2 half floats
layout(scalar) uniform Params {
#include "slice_params.glsl"
};
#include "stored_volume.glsl"
uniform texture3D volume;
uniform writeonly uimage3D packed_neighbours;

uint bits_of(float value) {
    if (STORED == 2) return packHalf2x16(vec2(value, 0.0));
    return uint(int(value * (STORED == 0 ? 255.0 : 65535.0) + 0.5));
}

// A texel and the one below it; beyond the last stored row it repeats.
uvec2 pair_at(ivec3 at, ivec2 last) {
    ivec2 near = min(at.xy, last);
    float value = texelFetch(volume, ivec3(near, at.z), 0).x;
    float below = texelFetch(volume, ivec3(near.x, min(near.y + 1, last.y), at.z), 0).x;
    return uvec2(bits_of(value), bits_of(below));
}

void main() {
    ivec3 to = ivec3(gl_GlobalInvocationID) * ivec3(RUN, 1, 1) + ivec3(first_column, first_row, slice) - first_stored;
    ivec3 size = imageSize(packed_neighbours);
    if (any(greaterThanEqual(to, size))) return;
    ivec3 at = to;
    ivec2 last = textureSize(volume, 0).xy - 1;
    uvec2 here = pair_at(at, last);
    for (int n = 0; n < RUN; ++n) {
        uvec2 next = pair_at(at + ivec3(1, 0, 0), last);
        uvec2 bits = STORED == 0 ? uvec2(here.x | next.x << 8 | here.y << 16 | next.y << 24, 0)
                                 : uvec2(here.x | next.x << 16, here.y | next.y << 16);
        if (to.x < size.x) imageStore(packed_neighbours, to, uvec4(bits, 0, 0));
        here = next;
        ++at.x;
        ++to.x;
    }
}
