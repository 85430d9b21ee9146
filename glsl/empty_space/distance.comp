// The Chebyshev distance in bricks to the nearest brick of another kind, one axis per dispatch. All bricks nearer than that are of
// one kind, so that a ray may skip them at once (Deakin and Knackstedt 2020).
#version 460
#include "common.glsl"
layout(constant_id = 0) const int AXIS = 0;
layout(constant_id = 1) const int BEYOND = 0; // the kind of everything beyond the bricks
uniform texture3D source;
uniform writeonly image3D target;

int code_at(ivec3 at) { return int(texelFetch(source, at, 0).x * 255.0 + 0.5); }

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID), size = imageSize(target);
    if (any(greaterThanEqual(at, size))) return;
    int code = code_at(at);
    int kind = code >> 6, best = code & 63;
    for (int r = 1; r < best; ++r) {
        for (int n = 0; n < 2; ++n) {
            ivec3 there = at;
            there[AXIS] += n == 0 ? r : -r;
            bool within = there[AXIS] >= 0 && there[AXIS] < size[AXIS];
            int other = code_at(clamp(there, ivec3(0), size - 1));
            // Everything beyond the bricks is of one kind.
            int distance = within ? other >> 6 == kind ? max(r, other & 63) : r : BEYOND == kind ? best : r;
            best = min(best, distance);
        }
    }
    imageStore(target, at, vec4(float(kind * 64 + best) / 255.0, 0.0, 0.0, 0.0));
}
