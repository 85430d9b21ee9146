// One explicit step of anisotropic diffusion with four neighbours (Perona and Malik 1990; thesis 5-9..5-12). Nothing flows
// across the border, nor to or from a miss.
// variants: slice; distance DISTANCE; picture PICTURE
#version 460
layout(constant_id = 0) const int CONDUCTANCE = 0; // 0 quotient, 1 exponential
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
    float edge;   // k, 1e-30..1e30
    float lambda; // 0..1/4
#include "slice_params.glsl"
};
#include "filter.glsl"
#include "diffusion.glsl"

void main() {
    ivec3 at = made_texel();
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    T here = read_at(at);
    if (!VALID(here)) {
        write_at(at, here);
        return;
    }
    T flux = T(0.0);
    for (int i = 0; i < 4; ++i) {
        ivec2 next = at.xy + ivec2((i & 1) * (i - 2), (1 - (i & 1)) * (i - 1));
        if (any(lessThan(next, ivec2(0))) || any(greaterThanEqual(next, size.xy))) continue;
        T there = read_at(ivec3(next, 0));
        if (!VALID(there)) continue;
        flux += across(there - here) * (there - here);
    }
    write_at(at, here + lambda * flux);
}
