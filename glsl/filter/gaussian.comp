// One axis of a separable Gaussian. Taps beyond the border are left out and the rest renormalised.
// variants: plane; slice SLICE; volume VOLUME
#version 460
layout(constant_id = 0) const int RADIUS = 3;
layout(constant_id = 1) const int AXIS = 0;
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
    float narrowness; // 1 / (2 sigma^2), a texel
#include "slice_params.glsl"
};
#include "filter.glsl"

void main() {
    ivec3 at = made_texel();
    ivec3 size = source_size();
#ifdef VOLUME
    at.z += slice; // the first that is made anew
#endif
    if (any(greaterThanEqual(at, size))) return;
    float sum = 0.0, weight = 0.0;
    for (int i = -RADIUS; i <= RADIUS; ++i) {
        ivec3 tap = at;
        tap[AXIS] += i;
        if (tap[AXIS] < 0 || tap[AXIS] >= size[AXIS]) continue;
        float w = exp(-float(i * i) * narrowness);
        sum += w * read_at(tap);
        weight += w;
    }
    write_at(at, sum / weight);
}
