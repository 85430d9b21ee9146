// The picture from the rendering: the mean of several rays per pixel, or interpolation between the rays where one ray makes several
// pixels; in a 4-up picture, the rendering next to the planes; in a pair, the composited volume next to the lit surface.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int RAYS = 1; // along each edge of a pixel
layout(constant_id = 1) const int APART = 1; // pixels between two rays along each axis
layout(constant_id = 2) const int LAYOUT = 0;
const int FOUR = 1, PAIR = 2; // 0 the rendering alone
uniform texture2D rendered;
uniform texture2D planes;     // of a 4-up picture
uniform texture2D composited; // of a pair
uniform writeonly image2D picture;

bool is_volume = false;
vec4 ray_at(ivec2 at) {
    if (LAYOUT == PAIR && is_volume) return texelFetch(composited, at, 0);
    return texelFetch(rendered, at, 0);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    ivec2 at = pixel;
    if (LAYOUT == FOUR) {
        // The rendering is the lower right tile.
        at = pixel - size / 2;
        if (any(lessThan(at, ivec2(0)))) {
            imageStore(picture, pixel, texelFetch(planes, pixel, 0));
            return;
        }
    }
    if (LAYOUT == PAIR) {
        // The volume is the left half.
        is_volume = pixel.x < size.x / 2;
        if (!is_volume) at.x -= size.x / 2;
    }
    // Colours are already multiplied by their opacity.
    if (APART > 1) {
        ivec2 last = textureSize(rendered, 0) - 1;
        vec2 place = clamp((vec2(at) + 0.5) / float(APART) - 0.5, vec2(0.0), vec2(last));
        ivec2 low = ivec2(place), high = min(low + 1, last);
        vec2 share = place - vec2(low);
        vec4 above = mix(ray_at(low), ray_at(ivec2(high.x, low.y)), share.x);
        vec4 below = mix(ray_at(ivec2(low.x, high.y)), ray_at(high), share.x);
        imageStore(picture, pixel, mix(above, below, share.y));
        return;
    }
    vec4 sum = vec4(0.0);
    for (int i = 0; i < RAYS * RAYS; ++i) sum += ray_at(at * RAYS + ivec2(i % RAYS, i / RAYS));
    imageStore(picture, pixel, sum / float(RAYS * RAYS));
}
