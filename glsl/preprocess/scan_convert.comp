// Converts polar frames into slices. The look-up table gives the fractional sample and line of each pixel. Pixels outside
// the sector are not written (thesis Fig. 31), or are black where a filter reads the slice next.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float gain; // stored value to 0..1
    float offset;
#include "slice_params.glsl"
};
uniform texture2DArray frames; // the batch's first frame is layer 0
uniform texture2D scan_lut;
#include "slice_target.glsl"

float sample_at(ivec2 at) { return texelFetch(frames, ivec3(at, gl_GlobalInvocationID.z), 0).x; }

void main() {
    ivec3 at = made_texel();
    if (any(greaterThanEqual(at.xy, textureSize(scan_lut, 0)))) return;
    vec2 index = texelFetch(scan_lut, at.xy, 0).xy;
    if (index.x < 0.0) { // outside the sector
        // Filters must not read what an earlier frame left there.
        if (LAYERED == 1) write_slice(at, 0.0);
        return;
    }
    ivec2 base = min(ivec2(index), textureSize(frames, 0).xy - 2);
    vec2 share = index - vec2(base);
    float near = mix(sample_at(base), sample_at(base + ivec2(1, 0)), share.x);
    float far = mix(sample_at(base + ivec2(0, 1)), sample_at(base + ivec2(1, 1)), share.x);
    write_slice(at, clamp(mix(near, far, share.y) * gain + offset, 0.0, 1.0));
}
