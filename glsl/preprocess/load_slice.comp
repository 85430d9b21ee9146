// A slice of a Cartesian volume, scaled to 0..1.
// variants: plane; slice SLICE
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float gain; // stored value to 0..1
    float offset;
#include "slice_params.glsl"
};
uniform texture2D frames; // one layer of the frame array
#include "slice_target.glsl"

void main() {
    ivec2 at = made_texel();
    if (any(greaterThanEqual(at, textureSize(frames, 0)))) return;
    write_slice(at, clamp(texelFetch(frames, at, 0).x * gain + offset, 0.0, 1.0));
}
