// Measures how fast the device reads and writes a picture without computing.
#version 460
#include "common.glsl"
uniform texture2D source;
uniform writeonly image2D target;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(target)))) return;
    imageStore(target, pixel, texelFetch(source, pixel, 0));
}
