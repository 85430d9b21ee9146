// Each texel of a slice with its neighbours one column and one row on, as they are stored, and of bytes those of the next slice as well.
// An interpolated sample then takes two loads, of bytes one. Both images hold the stored part of the volume.
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

uint bits_at(ivec3 at) { return bits_of(texelFetch(volume, at, 0).x); }

// A texel and the one below it, of bytes in two slices; beyond the last stored row or slice it repeats.
uvec2 pair_at(ivec3 at, ivec3 last) {
    ivec3 near = min(at, last), next = min(near + 1, last);
    uvec2 pair = uvec2(bits_at(near), bits_at(ivec3(near.x, next.y, near.z)));
    if (STORED == 0) pair |= uvec2(bits_at(ivec3(near.xy, next.z)), bits_at(ivec3(near.x, next.yz))) << 16;
    return pair;
}

void main() {
    ivec3 to = ivec3(gl_GlobalInvocationID) * ivec3(RUN, 1, 1) + ivec3(first_column, first_row, slice) - first_stored;
    ivec3 size = imageSize(packed_neighbours);
    if (any(greaterThanEqual(to, size))) return;
    ivec3 at = to;
    ivec3 last = textureSize(volume, 0) - 1;
    uvec2 here = pair_at(at, last);
    for (int n = 0; n < RUN; ++n) {
        uvec2 next = pair_at(at + ivec3(1, 0, 0), last);
        uvec2 bits = here | next << 16;
        if (STORED == 0) {
            uvec2 columns = here | next << 8; // of either row in both slices
            bits = uvec2((columns.x & 0xffff) | columns.y << 16, columns.x >> 16 | (columns.y & 0xffff0000u));
        }
        if (to.x < size.x) imageStore(packed_neighbours, to, uvec4(bits, 0, 0));
        here = next;
        ++at.x;
        ++to.x;
    }
}
