// The picture from the rendering: the mean of several rays per pixel, or interpolation between the rays where one ray makes four
// pixels; in a 4-up picture, the rendering next to the planes.
// variants: alone; four FOUR
#version 460
#include "common.glsl"
layout(constant_id = 0) const int RAYS = 1; // along each edge of a pixel
layout(constant_id = 1) const int HALF = 0; // one ray makes four pixels
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
    if (HALF == 1) {
        ivec2 last = textureSize(rendered, 0) - 1;
        vec2 place = clamp(0.5 * vec2(at) - 0.25, vec2(0.0), vec2(last));
        ivec2 low = ivec2(place), high = min(low + 1, last);
        vec2 share = place - vec2(low);
        vec4 above = mix(texelFetch(rendered, low, 0), texelFetch(rendered, ivec2(high.x, low.y), 0), share.x);
        vec4 below = mix(texelFetch(rendered, ivec2(low.x, high.y), 0), texelFetch(rendered, high, 0), share.x);
        imageStore(picture, pixel, mix(above, below, share.y));
        return;
    }
    vec4 sum = vec4(0.0);
    for (int i = 0; i < RAYS * RAYS; ++i) sum += texelFetch(rendered, at * RAYS + ivec2(i % RAYS, i / RAYS), 0);
    imageStore(picture, pixel, sum / float(RAYS * RAYS));
}
