// Texels that a workgroup reads once for all of its invocations: TILE_COLUMNS x TILE_ROWS of them, in rows of TILE_PITCH words of shared memory.
// A TILE_GAP more than 0 leaves a word out after as many columns: invocations that read so many columns apart read from other banks.
const int GROUP = 8; // invocations along each edge of a workgroup
shared float tile[TILED == 1 ? TILE_PITCH * TILE_ROWS : 1];

int tile_place(int column, int row) { return row * TILE_PITCH + column + (TILE_GAP > 0 ? column / max(TILE_GAP, 1) : 0); }

// `VALUE` of each texel from `first` on. All invocations of the workgroup are to get here.
#define FILL_TILE(first, VALUE) { \
    for (int row = int(gl_LocalInvocationID.y); row < TILE_ROWS; row += GROUP) { \
        for (int column = int(gl_LocalInvocationID.x); column < TILE_COLUMNS; column += GROUP) { \
            tile[tile_place(column, row)] = VALUE((first) + ivec3(column, row, 0)); \
        } \
    } \
    barrier(); \
}
