// Marks the pixels with an error larger than allowed and those beside them, a bit for each pixel of a tile of 8 x 8. The errors are kept: those of marked
// pixels are found again.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float allowed;
    int columns;
    int rows;
};
uniform texture2D first_errors;
uniform writeonly image2D errors;
uniform writeonly uimage2D error_marks;
shared uint marks[2];

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    uint n = gl_LocalInvocationIndex;
    if (n < 2u) marks[n] = 0u;
    barrier();
    if (all(lessThan(pixel, ivec2(columns, rows)))) {
        float error = texelFetch(first_errors, pixel, 0).x, most = error;
        imageStore(errors, pixel, vec4(error, 0.0, 0.0, 0.0));
        // What is thinner than a step may be seen by none of a ray's samples, but by some of those beside it.
        for (int k = 0; k < 9; ++k) {
            ivec2 beside = clamp(pixel + ivec2(k % 3, k / 3) - 1, ivec2(0), ivec2(columns, rows) - 1);
            most = max(most, texelFetch(first_errors, beside, 0).x);
        }
        if (error > 0.0 && most > allowed) atomicOr(marks[n >> 5], 1u << (n & 31u));
    }
    barrier();
    if (n == 0u) imageStore(error_marks, ivec2(gl_WorkGroupID.xy), uvec4(marks[0], marks[1], 0u, 0u));
}
