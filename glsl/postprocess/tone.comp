// The picture in 8 bits, toned; over planes with cross-lines and frames.
#version 460
#include "common.glsl"
#include "tone_constants.glsl"
layout(constant_id = 33) const int LINES = 0; // over planes: 1 in all of the picture, 2 in a part of it
layout(scalar) uniform Params {
#include "tone_params.glsl"
    int columns; // of planes
    int rows;
    float line_strength; // 0..1
    int tiles_x; // the first column and row of planes
    int tiles_y;
};
uniform texture2D picture;
uniform writeonly image2D screen;
#include "tiles.glsl"
#include "tone.glsl"
#include "cross_lines.glsl"

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(screen);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 lit = texelFetch(picture, pixel, 0);
    // Pixels without a hit stay black, whatever the brightness.
    vec3 c = lit.a > 0.0 ? toned(lit.rgb) : vec3(0.0);
    ivec2 first = LINES == 2 ? ivec2(tiles_x, tiles_y) : ivec2(0);
    if (LINES != 0 && all(greaterThanEqual(pixel, first))) c = with_lines(c, pixel - first, size - first);
    imageStore(screen, pixel, vec4(c, 1.0));
}
