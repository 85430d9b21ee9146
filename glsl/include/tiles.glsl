// The grid of tiles that a picture of planes is divided into, as scene::planes lays it out.
struct Tile {
    vec4 corner; // place of the upper left corner, mm
    vec4 dx;     // one pixel to the right
    vec4 dy;     // one pixel down
    vec4 slab;   // from the slab's near face to its far one
    vec4 frame;  // colour; w 0 none, 1 around the tile, 2 towards the tiles above and to the left
    vec4 line[2]; // where another plane cuts: dot(xy, pixel) + z is the distance in pixels; w 0 nowhere
    vec4 line_colour[2];
};
readonly buffer Tiles { Tile entry[]; } tiles;

// Column and row of the cell that holds a pixel: the largest n with floor(n size / cells) <= pixel.
ivec2 cell_of(ivec2 pixel, ivec2 size, ivec2 cells) { return ((pixel + 1) * cells - 1) / size; }
ivec2 cell_corner(ivec2 cell, ivec2 size, ivec2 cells) { return cell * size / cells; }
