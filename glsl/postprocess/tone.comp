// Contrast about the middle grey, brightness, gamma, colour map; 8 bits out. Over planes: cross-lines and frames, which no
// colour map changes.
// variants: plain; lines LINES
#version 460
#include "common.glsl"
layout(constant_id = 0) const int COLOUR_MAP = 0; // 1: brightness through the map below
layout(constant_id = 2) const int GAMMA = 1;      // 0: none, and no power is taken
#ifdef LINES
layout(constant_id = 1) const int CROSSING = 2; // planes whose lines cross each tile
#endif
layout(scalar) uniform Params {
    float brightness;
    float contrast;
    float exponent; // 1 / gamma
    vec3 map_0;
    vec3 map_1;
    vec3 map_2;
    vec3 map_3;
    vec3 map_4;
#ifdef LINES
    int columns;
    int rows;
    float line_strength; // 0..1
#endif
};
uniform texture2D picture;
uniform writeonly image2D screen;

vec3 toned(vec3 c) {
    c = clamp((c - 0.5) * contrast + 0.5 + brightness, 0.0, 1.0);
    if (GAMMA == 0) return c;
    // pow(0, x) of a driver may be anything that log2(0) * x makes.
    return mix(pow(max(c, vec3(1e-8)), vec3(exponent)), vec3(0.0), lessThanEqual(c, vec3(1e-8)));
}

#ifdef LINES
#include "tiles.glsl"

vec3 with_lines(vec3 c, ivec2 pixel, ivec2 size) {
    ivec2 cells = ivec2(columns, rows), cell = cell_of(pixel, size, cells);
    int n = cell.y * columns + cell.x;
    if (n >= tile_count()) return c;
    ivec2 corner = cell_corner(cell, size, cells), end = cell_corner(cell + 1, size, cells);
    vec2 at = vec2(pixel - corner) + 0.5;
    for (int i = 0; i < CROSSING; ++i) {
        vec4 line = tile_line(n, i);
        // As much of the pixel as a line one pixel wide covers.
        float cover = clamp(1.0 - abs(dot(line.xy, at) + line.z), 0.0, 1.0) * line.w;
        c = mix(c, tile_line_colour(n, i).rgb, line_strength * cover);
    }
    vec4 frame = tile_frame(n);
    bool around = any(equal(pixel, corner)) || any(equal(pixel, end - 1));
    bool between = (pixel.x == corner.x && corner.x > 0) || (pixel.y == corner.y && corner.y > 0);
    if ((frame.w == 1.0 && around) || (frame.w == 2.0 && between)) c = frame.rgb;
    return c;
}
#endif

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(screen);
    if (any(greaterThanEqual(pixel, size))) return;
    vec4 lit = texelFetch(picture, pixel, 0);
    // Where nothing was hit the picture stays black, whatever the brightness.
    vec3 c = lit.a > 0.0 ? toned(lit.rgb) : vec3(0.0);
    if (COLOUR_MAP == 1 && lit.a > 0.0) {
        float grey = dot(c, vec3(0.2126, 0.7152, 0.0722)) * 4.0;
        vec3 low = mix(map_0, map_1, clamp(grey, 0.0, 1.0));
        low = mix(low, map_2, clamp(grey - 1.0, 0.0, 1.0));
        low = mix(low, map_3, clamp(grey - 2.0, 0.0, 1.0));
        c = mix(low, map_4, clamp(grey - 3.0, 0.0, 1.0));
    }
#ifdef LINES
    c = with_lines(c, pixel, size);
#endif
    imageStore(screen, pixel, vec4(c, 1.0));
}
