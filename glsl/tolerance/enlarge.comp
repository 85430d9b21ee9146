// All pixels from the rays of the lattice, which go through every other pixel of every other row: those between are means of two or four. Where the picture
// bends by d from ray to ray, a mean is off by d / 8 in smooth parts and by d / 2 at a jump; d / 4 is stated, and added to the errors of the rays. Pixels with
// too large an error are marked, a bit for each pixel of a tile of 8 x 8.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float allowed;
    int columns;
    int rows;
};
uniform texture2D lattice;
uniform texture2D lattice_errors; // the colour on the screen; its error
uniform writeonly image2D picture;
uniform writeonly image2D errors;
uniform writeonly uimage2D error_marks;
// The rays of a tile's pixels, and one more on each side.
const int RAYS = 5, WIDE = RAYS + 2;
shared vec4 around[WIDE * WIDE];
shared float bends[RAYS * RAYS];
shared uint marks[2];

// A mean of rays that met nothing is no proof: what is between them may be thinner than their distance.
const float LEAST = 1e-6;

float largest(vec3 c) { return max(c.x, max(c.y, c.z)); }
float bend(int at, int apart) { return largest(abs(around[at - apart].rgb + around[at + apart].rgb - 2.0 * around[at].rgb)); }
int row_major(ivec2 at, int width) { return at.x + width * at.y; }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy), last = textureSize(lattice, 0) - 1;
    int n = int(gl_LocalInvocationIndex);
    if (n < 2) marks[n] = 0u;
    if (n < WIDE * WIDE) {
        ivec2 at = 4 * ivec2(gl_WorkGroupID.xy) + ivec2(n % WIDE, n / WIDE) - 1;
        around[n] = texelFetch(lattice_errors, clamp(at, ivec2(0), last), 0);
    }
    barrier();
    if (n < RAYS * RAYS) {
        int at = row_major(ivec2(n % RAYS, n / RAYS) + 1, WIDE);
        bends[n] = max(bend(at, 1), bend(at, WIDE)) / 4.0;
    }
    barrier();
    if (all(lessThan(pixel, ivec2(columns, rows)))) {
        ivec2 first = 4 * ivec2(gl_WorkGroupID.xy);
        vec4 rgba = vec4(0.0);
        float error = 0.0, most = 0.0;
        for (int k = 0; k < 4; ++k) {
            ivec2 at = min((pixel + ivec2(k & 1, k >> 1)) / 2, last);
            rgba += 0.25 * texelFetch(lattice, at, 0);
            error += 0.25 * around[row_major(at - first + 1, WIDE)].a;
            most = max(most, bends[row_major(at - first, RAYS)]);
        }
        bool is_between = any(equal(pixel & 1, ivec2(1)));
        // The last row or column has no rays behind it, if its number is odd.
        bool is_beyond = any(greaterThan((pixel + 1) / 2, last));
        // A ray beside an edge may have missed what makes it: it is cast again with shorter steps.
        bool is_beside = !is_between && error > 0.0 && most > allowed;
        if (is_between) error = max(error + most, LEAST);
        if (is_beside || is_between && (is_beyond || error > allowed)) atomicOr(marks[n >> 5], 1u << (n & 31));
        imageStore(picture, pixel, rgba);
        imageStore(errors, pixel, vec4(error, 0.0, 0.0, 0.0));
    }
    barrier();
    if (n == 0) imageStore(error_marks, ivec2(gl_WorkGroupID.xy), uvec4(marks[0], marks[1], 0u, 0u));
}
