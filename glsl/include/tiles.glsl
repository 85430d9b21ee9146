// The grid of tiles of a picture of planes, in the layout of scene::planes: TILE_VECTORS vectors per tile.
const int TILE_VECTORS = 9;
readonly buffer Tiles { vec4 entry[]; } tiles;

int tile_count() { return tiles.entry.length() / TILE_VECTORS; }
vec3 tile_corner(int tile) { return tiles.entry[tile * TILE_VECTORS].xyz; } // position of the upper left corner, mm
vec3 tile_dx(int tile) { return tiles.entry[tile * TILE_VECTORS + 1].xyz; } // one pixel to the right
vec3 tile_dy(int tile) { return tiles.entry[tile * TILE_VECTORS + 2].xyz; } // one pixel down
vec3 tile_slab(int tile) { return tiles.entry[tile * TILE_VECTORS + 3].xyz; } // from the slab's near face to its far one
// Colour; w 0 none, 1 around the tile, 2 towards the tiles above and to the left.
vec4 tile_frame(int tile) { return tiles.entry[tile * TILE_VECTORS + 4]; }
// The line of another plane: dot(xy, pixel) + z is the distance in pixels; w 0: no line.
vec4 tile_line(int tile, int n) { return tiles.entry[tile * TILE_VECTORS + 5 + n]; }
vec4 tile_line_colour(int tile, int n) { return tiles.entry[tile * TILE_VECTORS + 7 + n]; }

// Column and row of the cell that holds a pixel: the largest n with floor(n size / cells) <= pixel. Computed in floats, because a
// CPU divides integers lane by lane. Floats are exact up to 2^24, and half a unit keeps quotients away from integers.
ivec2 cell_of(ivec2 pixel, ivec2 size, ivec2 cells) { return ivec2((vec2((pixel + 1) * cells) - 0.5) / vec2(size)); }
ivec2 cell_corner(ivec2 cell, ivec2 size, ivec2 cells) { return ivec2((vec2(cell * size) + 0.5) / vec2(cells)); }
