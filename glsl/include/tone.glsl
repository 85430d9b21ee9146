// A colour as the screen shows it: contrast around middle grey, brightness, gamma, colour map; over planes also cross-lines and
// frames, to which no colour map is applied.
vec3 toned(vec3 c) {
    c = clamp((c - 0.5) * contrast + 0.5 + brightness, 0.0, 1.0);
    if (GAMMA != 0) {
        // A driver's pow(0, x) may be any result of log2(0) * x.
        c = mix(pow(max(c, vec3(1e-8)), vec3(exponent)), vec3(0.0), lessThanEqual(c, vec3(1e-8)));
    }
    if (COLOUR_MAP == 1) {
        float grey = dot(c, vec3(0.2126, 0.7152, 0.0722)) * 4.0;
        vec3 low = mix(map_0, map_1, clamp(grey, 0.0, 1.0));
        low = mix(low, map_2, clamp(grey - 1.0, 0.0, 1.0));
        low = mix(low, map_3, clamp(grey - 2.0, 0.0, 1.0));
        c = mix(low, map_4, clamp(grey - 3.0, 0.0, 1.0));
    }
    return c;
}

vec3 with_lines(vec3 c, ivec2 pixel, ivec2 size) {
    ivec2 cells = ivec2(columns, rows), cell = cell_of(pixel, size, cells);
    int n = cell.y * columns + cell.x;
    if (n >= tile_count()) return c;
    ivec2 corner = cell_corner(cell, size, cells), end = cell_corner(cell + 1, size, cells);
    vec2 at = vec2(pixel - corner) + 0.5;
    for (int i = 0; i < CROSSING; ++i) {
        vec4 line = tile_line(n, i);
        // The share of the pixel that a line one pixel wide covers.
        float cover = clamp(1.0 - abs(dot(line.xy, at) + line.z), 0.0, 1.0) * line.w;
        c = mix(c, tile_line_colour(n, i).rgb, line_strength * cover);
    }
    vec4 frame = tile_frame(n);
    bool around = any(equal(pixel, corner)) || any(equal(pixel, end - 1));
    bool between = (pixel.x == corner.x && corner.x > 0) || (pixel.y == corner.y && corner.y > 0);
    if ((frame.w == 1.0 && around) || (frame.w == 2.0 && between)) c = frame.rgb;
    return c;
}
