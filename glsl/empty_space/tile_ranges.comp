// The smallest and the largest value of every tile, for the slices that a new frame changes.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int TILE = 4;
layout(scalar) uniform Params {
#include "slice_params.glsl"
};
#include "stored_volume.glsl"
uniform texture3D volume;
uniform writeonly image3D tile_ranges;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID) + ivec3(first_column / TILE, first_row / TILE, slice);
    if (any(greaterThanEqual(at, imageSize(tile_ranges)))) return;
    ivec2 first = at.xy * TILE - first_stored.xy, last = textureSize(volume, 0).xy - 1;
    float low = 1.0, high = 0.0;
    for (int n = 0; n < TILE * TILE; ++n) {
        // Beyond the border the last texel repeats. Where that is not the volume's, it is the border of a tile.
        ivec2 tap = min(first + ivec2(n % TILE, n / TILE), last);
        float value = texelFetch(volume, ivec3(tap, at.z - first_stored.z), 0).x;
        low = min(low, value);
        high = max(high, value);
    }
    // Rounded outwards to the 16 bits that are stored.
    vec2 range = vec2(floor(low * 65535.0), ceil(high * 65535.0)) / 65535.0;
    imageStore(tile_ranges, at, vec4(range, 0.0, 0.0));
}
