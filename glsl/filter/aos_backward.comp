// Backward substitution along a row or a column, an invocation each: u[i] = forward[i] + shares[i] u[i+1].
// variants: slice; picture PICTURE
#version 460
layout(local_size_x = 64) in;
#include "aos.glsl"
layout(scalar) uniform Params {
#include "aos_target_params.glsl"
};
uniform TEXTURE shares;
uniform TEXTURE forward;
#include "aos_target.glsl"

void main() {
    int line = int(gl_GlobalInvocationID.x);
    ivec2 size = textureSize(shares, 0).xy;
    if (line >= size[1 - AXIS]) return;
    T u = T(0.0);
    for (int i = size[AXIS] - 1; i >= 0; --i) {
        TEXEL at = texel(line, i);
        u = LOADED(texelFetch(forward, at, 0)) + texelFetch(shares, at, 0).x * u;
        write_solution(at, u);
    }
}
