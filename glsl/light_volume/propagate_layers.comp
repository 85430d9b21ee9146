// The same light as propagate.comp, through several layers at once: a dispatch a layer with a barrier behind it takes a GPU longer than the layer
// itself. A workgroup brings light to a tile of cells. It begins with a region that is wider than the tile by as many cells as there are layers, which
// lies where the tile's light comes from, keeps the light in shared memory, and loses one cell on every side with each layer: workgroups compute
// the borders of their regions more than once instead of waiting for each other (overlapped tiling).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
#extension GL_EXT_control_flow_attributes : require
const int TILE = 16;
const int LAYERS = 8;
const int REGION = TILE + 2 * LAYERS;
// An invocation for each cell of the region: few invocations with several cells each leave a processor waiting for the cells' shared memory.
layout(local_size_x = REGION, local_size_y = REGION) in;
layout(scalar) uniform Params {
    int layer;
    int from_high; // 1: each layer is followed by the one before it
    int count;     // of layers, 1..LAYERS
    int last_layer;    // of the lattice
    float outer_share; // of the lattice's outermost layers that is within the box, and absorbs
#include "propagation_params.glsl"
};
#include "propagation.glsl"

// Of the last layer and of this one, in turns: one barrier a layer is enough.
const int CELLS = REGION * REGION;
shared float red[2 * CELLS];
shared float green[2 * CELLS];
shared float blue[2 * CELLS];

void keep(int n, vec3 light) {
    red[n] = light.r;
    green[n] = light.g;
    blue[n] = light.b;
}

void main() {
    ivec2 cell = ivec2(gl_LocalInvocationID.xy), size = imageSize(next_front), tile = TILE * ivec2(gl_WorkGroupID.xy);
    ivec2 whole = ivec2(floor(shift + 0.5));
    vec3 across = weights_of(shift.x - float(whole.x)), down = weights_of(shift.y - float(whole.y));
    // Where the cell lies before the first layer; with every layer it goes back by `whole`.
    ivec2 at = tile - LAYERS + LAYERS * whole + cell;
    int mine = cell.y * REGION + cell.x;
    vec3 light = vec3(1.0);
    if (FIRST == 0) light = texelFetch(front, clamp(at, ivec2(0), size - 1), 0).rgb;
    keep(mine, light);
    float density = texelFetch(matter, cell_of(layer, clamp(at - whole, ivec2(0), size - 1)), 0).x;
    for (int step = 1; step <= count; ++step) {
        // Where the region lay with the last layer.
        ivec2 from = at - cell;
        at -= whole;
        int last = (step - 1) % 2 * CELLS, now = step % 2 * CELLS;
        // That of the next layer is on its way while this one is lit.
        int next = min(step + 1, count) - 1;
        int there = from_high == 1 ? layer - next : layer + next;
        float next_density = texelFetch(matter, cell_of(there, clamp(at - whole, ivec2(0), size - 1)), 0).x;
        int here = from_high == 1 ? layer + 1 - step : layer - 1 + step;
        float share = here == 0 || here == last_layer ? outer_share : 1.0;
        barrier();
        // What the light of the tile does not come from, and what is not there, is left out.
        bool is_needed = all(greaterThanEqual(cell, ivec2(step))) && all(lessThan(cell, ivec2(REGION - step)));
        if (is_needed && all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, size))) {
            light = vec3(1.0);
            if (FIRST == 0 || step > 1) {
                light = vec3(0.0);
                // A place at the border takes the light of the nearest there is, which is one of the nine.
                int columns[3], rows[3];
                [[unroll]] for (int i = 0; i < 3; ++i) {
                    columns[i] = clamp(at.x + whole.x + i - 1, 0, size.x - 1) - from.x;
                    rows[i] = last + (clamp(at.y + whole.y + i - 1, 0, size.y - 1) - from.y) * REGION;
                }
                [[unroll]] for (int y = 0; y < 3; ++y) {
                    [[unroll]] for (int x = 0; x < 3; ++x) {
                        int n = rows[y] + columns[x];
                        light += across[x] * down[y] * vec3(red[n], green[n], blue[n]);
                    }
                }
            }
            vec3 absorbed = half_way(share * density);
            light *= absorbed;
            vec3 onward = light * absorbed;
            keep(now + mine, onward);
            // Each cell belongs to one tile, wherever its light comes from.
            if (all(greaterThanEqual(at, tile)) && all(lessThan(at, tile + TILE))) {
                imageStore(arriving, cell_of(here, at), vec4(light, density));
                if (step == count) imageStore(next_front, at, vec4(onward, 1.0));
            }
        }
        density = next_density;
    }
}
