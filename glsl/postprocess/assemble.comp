// From what was rendered to the picture: the mean of several rays a pixel, and its place beside the planes of a 4-up picture.
// variants: alone; four FOUR
#version 460
#include "common.glsl"
layout(constant_id = 0) const int RAYS = 1; // along each edge of a pixel
uniform texture2D rendered;
#ifdef FOUR
uniform texture2D planes;
#endif
uniform writeonly image2D picture;

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    ivec2 at = pixel;
#ifdef FOUR
    // The rendering is the lower right tile.
    at = pixel - size / 2;
    if (any(lessThan(at, ivec2(0)))) {
        imageStore(picture, pixel, texelFetch(planes, pixel, 0));
        return;
    }
#endif
    // Colours are already multiplied by their opacity.
    vec4 sum = vec4(0.0);
    for (int i = 0; i < RAYS * RAYS; ++i) sum += texelFetch(rendered, at * RAYS + ivec2(i % RAYS, i / RAYS), 0);
    imageStore(picture, pixel, sum / float(RAYS * RAYS));
}
