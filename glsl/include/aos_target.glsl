// Where the solutions of AOS go. The columns' result is averaged with the rows' result, which ends a step of the scheme; of two half
// steps with Richardson's extrapolation, twice that less the result of one complete step.
layout(constant_id = 3) const int RICHARDSON = 0; // 1: this dispatch ends both half steps
uniform TEXTURE rows;        // of columns
uniform TEXTURE step_result; // of Richardson's extrapolation
#ifdef PICTURE
uniform writeonly image2D target;
#else
#include "volume_target.glsl"
#endif

void write_solution(TEXEL at, T u) {
    T result = u;
    if (AXIS == 1) result = 0.5 * (LOADED(texelFetch(rows, at, 0)) + u);
    if (RICHARDSON == 1) result = 2.0 * result - LOADED(texelFetch(step_result, at, 0));
#ifdef PICTURE
    imageStore(target, at, STORED(result));
#else
    ivec3 to = place_in_target(at);
    // All of a slice is solved, and a part of the volume stored.
    if (LAYERED == 1 || all(lessThan(uvec3(to), uvec3(imageSize(target))))) imageStore(target, to, STORED(result));
#endif
}
