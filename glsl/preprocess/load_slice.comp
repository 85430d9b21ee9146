// A slice of a Cartesian volume, scaled to 0..1.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float gain; // stored value to 0..1
    float offset;
#include "slice_params.glsl"
};
uniform texture2DArray frames; // the batch's first frame is layer 0
#include "slice_target.glsl"

void main() {
    ivec3 at = made_texel();
    if (any(greaterThanEqual(at.xy, textureSize(frames, 0).xy))) return;
    write_slice(at, clamp(texelFetch(frames, ivec3(at.xy, gl_GlobalInvocationID.z), 0).x * gain + offset, 0.0, 1.0));
}
