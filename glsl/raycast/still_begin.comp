// The sums of a still before its first path.
#version 460
#include "common.glsl"
uniform writeonly image2D next_sums;
uniform writeonly image2D next_squares;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(next_sums)))) return;
    imageStore(next_sums, pixel, vec4(0.0));
    imageStore(next_squares, pixel, vec4(0.0));
}
