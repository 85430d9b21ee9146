// Marks pixels that one ray does not stand for: those whose colour on the screen is not between the colours of the pixels on both sides, along any of
// four directions. In a picture that is straight across a pixel, the ray in its middle is the mean of any rays around it.
#version 460
#include "common.glsl"
#include "tone_constants.glsl"
layout(scalar) uniform Params {
#include "tone_params.glsl"
    float threshold; // second difference of the colour, 0..1
};
uniform texture2D picture;
uniform writeonly image2D marks;
#include "tone.glsl"

vec3 colour_at(ivec2 at) {
    vec4 lit = texelFetch(picture, clamp(at, ivec2(0), textureSize(picture, 0) - 1), 0);
    return lit.a > 0.0 ? toned(lit.rgb) : vec3(0.0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(marks)))) return;
    vec3 twice = 2.0 * colour_at(pixel), most = vec3(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 along = i == 0 ? ivec2(1, 0) : ivec2(i - 2, 1);
        most = max(most, abs(colour_at(pixel + along) + colour_at(pixel - along) - twice));
    }
    bool is_marked = max(most.x, max(most.y, most.z)) > threshold;
    imageStore(marks, pixel, vec4(is_marked ? 1.0 : 0.0));
}
