// One stage of a step of anisotropic diffusion by the Runge-Kutta-Legendre method of first order (Meyer, Balsara and Aslam 2014):
// y[j] = mu y[j-1] + nu y[j-2] + share M(y[j-1]), M the flow from the four neighbours. Nothing flows across the border.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int CONDUCTANCE = 0; // 0 quotient, 1 exponential
layout(constant_id = 1) const int FIRST = 0;       // 1: the first stage, which has no y[j-2]
layout(scalar) uniform Params {
    float edge; // k, 1e-30..1e30
    float mu;
    float nu;
    float share;
    int slice;
    // The texel of the volume that its image begins with.
    int first_stored_column;
    int first_stored_row;
    int first_stored_slice;
};
#define T float
#include "diffusion.glsl"
uniform texture2DArray last; // y[j-1]
uniform texture2DArray before; // y[j-2]
#include "volume_target.glsl"

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID); // z is the slice within the batch
    ivec2 size = textureSize(last, 0).xy;
    if (any(greaterThanEqual(at.xy, size))) return;
    float here = texelFetch(last, at, 0).x;
    float flow = 0.0;
    for (int i = 0; i < 4; ++i) {
        ivec2 next = at.xy + ivec2((i & 1) * (i - 2), (1 - (i & 1)) * (i - 1));
        if (any(lessThan(next, ivec2(0))) || any(greaterThanEqual(next, size))) continue;
        float away = texelFetch(last, ivec3(next, at.z), 0).x - here;
        flow += across(away) * away;
    }
    float result = mu * here + share * flow;
    if (FIRST == 0) result += nu * texelFetch(before, at, 0).x;
    ivec3 to = place_in_target(at);
    // All of a slice is solved, and a part of the volume stored.
    if (LAYERED == 1 || all(lessThan(uvec3(to), uvec3(imageSize(target))))) imageStore(target, to, vec4(result, 0.0, 0.0, 0.0));
}
