// Backward substitution along a row or a column: u[i] = forward[i] + shares[i] u[i+1]. The columns' result is averaged with the
// rows' result, which ends a step of the AOS scheme; of two half steps with Richardson's extrapolation, twice that less the
// result of one complete step.
// variants: rows; plane COLUMNS; slice COLUMNS SLICE; richardson_plane COLUMNS RICHARDSON; richardson_slice COLUMNS SLICE RICHARDSON; picture_rows PICTURE; picture COLUMNS PICTURE
#version 460
#include "aos.glsl"
layout(scalar) uniform Params {
    int slice;
#ifndef PICTURE
    // The texel of the volume that its image begins with.
    int first_stored_column;
    int first_stored_row;
    int first_stored_slice;
#endif
};
uniform texture2D shares;
uniform texture2D forward;
#ifdef COLUMNS
uniform texture2D rows;
#endif
#ifdef RICHARDSON
uniform texture2D step_result;
#endif
#ifdef SLICE
#include "stored_volume.glsl"
uniform writeonly image3D target;
#else
uniform writeonly image2D target;
#endif

void main() {
    int line = int(gl_GlobalInvocationID.x);
    ivec2 size = textureSize(shares, 0);
    if (line >= size[1 - AXIS]) return;
    T u = T(0.0);
    for (int i = size[AXIS] - 1; i >= 0; --i) {
        ivec2 at = texel(line, i);
        u = LOADED(texelFetch(forward, at, 0)) + texelFetch(shares, at, 0).x * u;
#ifdef COLUMNS
        T result = 0.5 * (LOADED(texelFetch(rows, at, 0)) + u);
#else
        T result = u;
#endif
#ifdef RICHARDSON
        result = 2.0 * result - LOADED(texelFetch(step_result, at, 0));
#endif
#ifdef SLICE
        ivec3 to = ivec3(at, slice) - first_stored;
        if (all(lessThan(uvec3(to), uvec3(imageSize(target))))) imageStore(target, to, STORED(result));
#else
        imageStore(target, at, STORED(result));
#endif
    }
}
