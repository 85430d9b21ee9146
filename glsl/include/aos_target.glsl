// Where the solutions of AOS go. The columns' result is averaged with the rows' result, which ends a step of the scheme; of two half
// steps with Richardson's extrapolation, twice that less the result of one complete step.
#ifdef COLUMNS
uniform TEXTURE rows;
#endif
#ifdef RICHARDSON
uniform TEXTURE step_result;
#endif
#ifdef SLICE
#include "stored_volume.glsl"
uniform writeonly image3D target;
#else
uniform writeonly IMAGE target;
#endif

void write_solution(TEXEL at, T u) {
#ifdef COLUMNS
    T result = 0.5 * (LOADED(texelFetch(rows, at, 0)) + u);
#else
    T result = u;
#endif
#ifdef RICHARDSON
    result = 2.0 * result - LOADED(texelFetch(step_result, at, 0));
#endif
#ifdef SLICE
    ivec3 to = at + ivec3(0, 0, slice) - first_stored;
    if (all(lessThan(uvec3(to), uvec3(imageSize(target))))) imageStore(target, to, STORED(result));
#else
    imageStore(target, at, STORED(result));
#endif
}
