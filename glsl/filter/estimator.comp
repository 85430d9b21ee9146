// A local estimator as a filter: median, Perona-Malik, gradient-inverse, Nagao-Matsuyama (thesis 5.3.1).
#version 460
layout(constant_id = 0) const int ESTIMATOR = 0;
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
    float edge;  // k of Perona-Malik
    float least; // smallest difference that gradient-inverse distinguishes
#include "slice_params.glsl"
};
#include "filter.glsl"
float level(ivec2 at) { return read_at(ivec3(at, 0)); }
#include "estimators.glsl"

void main() {
    ivec3 at = made_texel();
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    write_at(at, estimate(at.xy, size.xy - 1));
}
