// The same light as propagate.comp, through several layers at once: a dispatch a layer with a barrier behind it takes a GPU longer than the layer
// itself. A workgroup brings light to a tile of cells. It begins with a region that is wider than the tile by as many cells as there are layers, which
// lies where the tile's light comes from, keeps the light in shared memory, and loses one cell on every side with each layer: workgroups compute
// the borders of their regions more than once instead of waiting for each other (overlapped tiling).
#version 460
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
const int TILE = 16;
const int LAYERS = 8;
const int REGION = TILE + 2 * LAYERS;
const int EACH = REGION * REGION / (TILE * TILE); // cells of an invocation
layout(local_size_x = TILE, local_size_y = TILE) in;
layout(scalar) uniform Params {
    int layer;
    int from_high; // 1: each layer is followed by the one before it
    int count;     // of layers, 1..LAYERS
#include "propagation_params.glsl"
};
#include "propagation.glsl"

shared float red[REGION * REGION];
shared float green[REGION * REGION];
shared float blue[REGION * REGION];

// The cell of an invocation in the region.
ivec2 mine(int i) { return ivec2(gl_LocalInvocationID.xy) + TILE * ivec2(i % (REGION / TILE), i / (REGION / TILE)); }

void main() {
    ivec2 size = imageSize(next_front), tile = TILE * ivec2(gl_WorkGroupID.xy), whole = ivec2(floor(shift + 0.5));
    vec3 across = weights_of(shift.x - float(whole.x)), down = weights_of(shift.y - float(whole.y));
    // Where the region lies before the first layer; with every layer it goes back by `whole`.
    ivec2 low = tile - LAYERS + LAYERS * whole;
    for (int i = 0; i < EACH; ++i) {
        ivec2 cell = mine(i), at = clamp(low + cell, ivec2(0), size - 1);
        int n = cell.y * REGION + cell.x;
        vec3 light = vec3(1.0);
        if (FIRST == 0) light = texelFetch(front, at, 0).rgb;
        red[n] = light.r;
        green[n] = light.g;
        blue[n] = light.b;
    }
    for (int step = 1; step <= count; ++step) {
        ivec2 from = low;
        low -= whole;
        barrier();
        vec3 onward[EACH];
        for (int i = 0; i < EACH; ++i) {
            ivec2 cell = mine(i), at = low + cell;
            onward[i] = vec3(0.0);
            // What the light of the tile does not come from, and what is not there, is left out.
            bool is_needed = all(greaterThanEqual(cell, ivec2(step))) && all(lessThan(cell, ivec2(REGION - step)));
            if (!is_needed || any(lessThan(at, ivec2(0))) || any(greaterThanEqual(at, size))) continue;
            ivec3 place = cell_of(from_high == 1 ? layer + 1 - step : layer - 1 + step, at);
            float density = texelFetch(matter, place, 0).x;
            vec3 light = vec3(1.0);
            if (FIRST == 0 || step > 1) {
                light = vec3(0.0);
                for (int y = 0; y < 3; ++y) {
                    for (int x = 0; x < 3; ++x) {
                        // A place at the border takes the light of the nearest there is, which is one of the nine.
                        ivec2 tap = clamp(at + whole + ivec2(x, y) - 1, ivec2(0), size - 1) - from;
                        int n = tap.y * REGION + tap.x;
                        light += across[x] * down[y] * vec3(red[n], green[n], blue[n]);
                    }
                }
            }
            vec3 absorbed = half_way(density);
            light *= absorbed;
            onward[i] = light * absorbed;
            // Each cell belongs to one tile, wherever its light comes from.
            if (any(lessThan(at, tile)) || any(greaterThanEqual(at, tile + TILE))) continue;
            imageStore(arriving, place, vec4(light, density));
            if (step == count) imageStore(next_front, at, vec4(onward[i], 1.0));
        }
        barrier();
        for (int i = 0; i < EACH; ++i) {
            ivec2 cell = mine(i);
            int n = cell.y * REGION + cell.x;
            red[n] = onward[i].r;
            green[n] = onward[i].g;
            blue[n] = onward[i].b;
        }
    }
}
