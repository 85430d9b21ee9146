// The picture in 8 bits, toned; over planes with cross-lines and frames.
// variants: plain; lines LINES
#version 460
#include "common.glsl"
#include "tone_constants.glsl"
layout(scalar) uniform Params {
#include "tone_params.glsl"
#ifdef LINES
    int columns;
    int rows;
    float line_strength; // 0..1
#endif
};
uniform texture2D picture;
uniform writeonly image2D screen;
#ifdef LINES
#include "tiles.glsl"
#endif
#include "tone.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(screen);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 lit = texelFetch(picture, pixel, 0);
    // Pixels without a hit stay black, whatever the brightness.
    vec3 c = lit.a > 0.0 ? toned(lit.rgb) : vec3(0.0);
#ifdef LINES
    c = with_lines(c, pixel, size);
#endif
    imageStore(screen, pixel, vec4(c, 1.0));
}
