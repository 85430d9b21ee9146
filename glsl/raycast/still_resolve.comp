// A still as it is shown: the mean of the paths of each pixel, on film.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float share; // of a path: 1 / their number
    float exposure;
    vec3 ground_middle;
    vec3 ground_edge;
};
uniform texture2D sums;
uniform writeonly image2D picture;
#include "film.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 mean = share * texelFetch(sums, pixel, 0);
    imageStore(picture, pixel, on_film(mean.rgb, min(mean.a, 1.0), pixel, size));
}
