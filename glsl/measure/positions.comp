// One sample of a volume for each texel of the output, at positions inside of it and beyond its borders: to check the device's filter
// sample by sample.
#version 460
#include "common.glsl"
uniform sampler3D volume;
uniform writeonly image2D values;

void main() {
    ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(values);
    if (any(greaterThanEqual(texel, size))) return;
    // From an eighth of the volume before its border to an eighth behind it. The last axis takes 61 values in turn.
    int turn = (13 * texel.x + 29 * texel.y) % 61;
    vec3 share = vec3((vec2(texel) + 0.5) / vec2(size), (float(turn) + 0.5) / 61.0);
    float value = textureLod(volume, share * 1.25 - 0.125, 0.0).x;
    imageStore(values, texel, vec4(value, 0.0, 0.0, 0.0));
}
