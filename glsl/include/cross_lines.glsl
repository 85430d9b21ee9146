// Over planes: cross-lines and frames, to which no colour map is applied.
layout(constant_id = 32) const int CROSSING = 2; // planes whose lines cross each tile

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
