// Solves (I - 2 tau A) u = f along a row or a column, a workgroup each; A is the diffusion of that axis. Parallel cyclic reduction (Hockney
// 1965) takes the system apart into one for each invocation, which solves it by elimination, as Zhang, Cohen and Owens (2010) do.
// An equation is u[i] = before u[i-n] + after u[i+n] + right, and `kept` is what `before` and `after` lack to 1: carried, not computed, so that
// all terms are positive. Nothing cancels, and the maximum principle holds at any tau (Grassmann, Taksar and Heyman 1985).
// variants: slice; picture PICTURE
#version 460
#extension GL_EXT_control_flow_attributes : require
const int THREADS = 128;
layout(local_size_x = THREADS) in;
#include "aos.glsl"
layout(constant_id = 1) const int CONDUCTANCE = 0; // 0 quotient, 1 exponential
layout(constant_id = 2) const int CHUNK = 1;       // unknowns that an invocation solves
layout(scalar) uniform Params {
    float edge; // k, 1e-30..1e30
    float tau;
#include "aos_target_params.glsl"
};
#include "diffusion.glsl"
uniform TEXTURE source;
#include "aos_target.glsl"

const int ALL = THREADS * CHUNK;
shared float befores[ALL];
shared float afters[ALL];
shared float kepts[ALL];
shared T rights[ALL];

void main() {
    int line = int(gl_WorkGroupID.x), first = int(gl_LocalInvocationID.x);
    int count = textureSize(source, 0).xy[AXIS];
    float before[CHUNK], after[CHUNK], kept[CHUNK];
    T right[CHUNK];
    [[unroll]] for (int j = 0; j < CHUNK; ++j) {
        int i = first + THREADS * j;
        right[j] = LOADED(texelFetch(source, texel(line, min(i, count - 1)), 0));
        rights[i] = right[j];
    }
    barrier();
    // What is beyond the end of the line is linked to nothing.
    [[unroll]] for (int j = 0; j < CHUNK; ++j) {
        int i = first + THREADS * j;
        float back = i > 0 && i < count ? 2.0 * tau * across(right[j] - rights[max(i - 1, 0)]) : 0.0;
        float on = i + 1 < count ? 2.0 * tau * across(rights[min(i + 1, ALL - 1)] - right[j]) : 0.0;
        float diagonal = 1.0 + back + on;
        before[j] = back / diagonal;
        after[j] = on / diagonal;
        kept[j] = 1.0 / diagonal;
        right[j] /= diagonal;
    }
    for (int apart = 1; apart < min(count, THREADS); apart *= 2) {
        barrier(); // everybody has read what is overwritten
        [[unroll]] for (int j = 0; j < CHUNK; ++j) {
            int i = first + THREADS * j;
            befores[i] = before[j];
            afters[i] = after[j];
            kepts[i] = kept[j];
            rights[i] = right[j];
        }
        barrier();
        [[unroll]] for (int j = 0; j < CHUNK; ++j) {
            int i = first + THREADS * j;
            // Beyond the ends `before` or `after` is 0.
            int low = max(i - apart, 0), high = min(i + apart, ALL - 1);
            float b = before[j] * befores[low], a = after[j] * afters[high];
            float k = kept[j] + before[j] * kepts[low] + after[j] * kepts[high];
            float diagonal = k + b + a;
            right[j] = (right[j] + before[j] * rights[low] + after[j] * rights[high]) / diagonal;
            before[j] = b / diagonal;
            after[j] = a / diagonal;
            kept[j] = k / diagonal;
        }
    }
    // Now every THREADS-th unknown is a system of its own.
    float complement = 1.0;
    T u = T(0.0);
    [[unroll]] for (int j = 0; j < CHUNK; ++j) {
        float own = kept[j] + before[j] * complement;
        float diagonal = own + after[j];
        u = (right[j] + before[j] * u) / diagonal;
        right[j] = u;
        after[j] /= diagonal;
        complement = own / diagonal;
    }
    u = T(0.0);
    [[unroll]] for (int j = CHUNK - 1; j >= 0; --j) {
        int i = first + THREADS * j;
        u = right[j] + after[j] * u;
        if (i < count) write_solution(texel(line, i), u);
    }
}
