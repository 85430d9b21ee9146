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
const int EACH = REGION * REGION / (TILE * TILE); // cells of an invocation
layout(local_size_x = TILE, local_size_y = TILE) in;
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

// The cell of an invocation in the region.
ivec2 mine(int i) { return ivec2(gl_LocalInvocationID.xy) + TILE * ivec2(i % (REGION / TILE), i / (REGION / TILE)); }

void keep(int n, vec3 light) {
    red[n] = light.r;
    green[n] = light.g;
    blue[n] = light.b;
}

void main() {
    ivec2 size = imageSize(next_front), tile = TILE * ivec2(gl_WorkGroupID.xy), whole = ivec2(floor(shift + 0.5));
    vec3 across = weights_of(shift.x - float(whole.x)), down = weights_of(shift.y - float(whole.y));
    // Where the region lies before the first layer; with every layer it goes back by `whole`.
    ivec2 low = tile - LAYERS + LAYERS * whole;
    float densities[EACH];
    [[unroll]] for (int i = 0; i < EACH; ++i) {
        ivec2 cell = mine(i);
        vec3 light = vec3(1.0);
        if (FIRST == 0) light = texelFetch(front, clamp(low + cell, ivec2(0), size - 1), 0).rgb;
        keep(cell.y * REGION + cell.x, light);
        densities[i] = texelFetch(matter, cell_of(layer, clamp(low - whole + cell, ivec2(0), size - 1)), 0).x;
    }
    for (int step = 1; step <= count; ++step) {
        ivec2 from = low;
        low -= whole;
        int last = (step - 1) % 2 * CELLS, now = step % 2 * CELLS;
        // Those of the next layer are on their way while this one is lit.
        float next_densities[EACH];
        int next = min(step + 1, count) - 1;
        [[unroll]] for (int i = 0; i < EACH; ++i) {
            ivec2 at = clamp(low - whole + mine(i), ivec2(0), size - 1);
            next_densities[i] = texelFetch(matter, cell_of(from_high == 1 ? layer - next : layer + next, at), 0).x;
        }
        int here = from_high == 1 ? layer + 1 - step : layer - 1 + step;
        float share = here == 0 || here == last_layer ? outer_share : 1.0;
        barrier();
        [[unroll]] for (int i = 0; i < EACH; ++i) {
            ivec2 cell = mine(i), at = low + cell;
            float density = densities[i];
            densities[i] = next_densities[i];
            // What the light of the tile does not come from, and what is not there, is left out.
            bool is_needed = all(greaterThanEqual(cell, ivec2(step))) && all(lessThan(cell, ivec2(REGION - step)));
            if (!is_needed || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
            vec3 light = vec3(1.0);
            if (FIRST == 0 || step > 1) {
                light = vec3(0.0);
                [[unroll]] for (int y = 0; y < 3; ++y) {
                    [[unroll]] for (int x = 0; x < 3; ++x) {
                        // A place at the border takes the light of the nearest there is, which is one of the nine.
                        ivec2 tap = clamp(at + whole + ivec2(x, y) - 1, ivec2(0), size - 1) - from;
                        int n = last + tap.y * REGION + tap.x;
                        light += across[x] * down[y] * vec3(red[n], green[n], blue[n]);
                    }
                }
            }
            vec3 absorbed = half_way(share * density);
            light *= absorbed;
            vec3 onward = light * absorbed;
            keep(now + cell.y * REGION + cell.x, onward);
            // Each cell belongs to one tile, wherever its light comes from.
            if (any(lessThan(at, tile)) || any(greaterThanEqual(at, tile + TILE))) continue;
            imageStore(arriving, cell_of(here, at), vec4(light, density));
            if (step == count) imageStore(next_front, at, vec4(onward, 1.0));
        }
    }
}
