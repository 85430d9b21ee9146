// Forward elimination of (I - 2 tau A) u = f along a row or a column, an invocation each; A is the diffusion of that axis (Weickert, ter Haar
// Romeny and Viergever 1998). Every unknown becomes u[i] = forward[i] + shares[i] u[i+1].
// variants: slice; picture PICTURE
#version 460
layout(local_size_x = 64) in;
#include "aos.glsl"
layout(constant_id = 1) const int CONDUCTANCE = 0; // 0 quotient, 1 exponential
layout(scalar) uniform Params {
    float edge; // k, 1e-30..1e30
    float tau;
};
#include "diffusion.glsl"
uniform TEXTURE source;
uniform writeonly IMAGE shares;
uniform writeonly IMAGE forward;

void main() {
    int line = int(gl_GlobalInvocationID.x);
    ivec2 size = textureSize(source, 0).xy;
    if (line >= size[1 - AXIS]) return;
    int count = size[AXIS];
    T here = LOADED(texelFetch(source, texel(line, 0), 0)), before = T(0.0);
    // The diagonal is 1 + back + on, minus back times the last share. The complement of that share to 1 is carried instead, so that
    // all terms are positive: nothing cancels, and the maximum principle holds at any tau (Grassmann, Taksar and Heyman 1985).
    float back = 0.0, kept = 1.0;
    for (int i = 0; i < count; ++i) {
        T next = here;
        float on = 0.0;
        if (i + 1 < count) {
            next = LOADED(texelFetch(source, texel(line, i + 1), 0));
            on = 2.0 * tau * across(next - here);
        }
        float own = 1.0 + back * kept;
        float diagonal = own + on;
        before = (here + back * before) / diagonal;
        imageStore(shares, texel(line, i), vec4(on / diagonal, 0.0, 0.0, 0.0));
        imageStore(forward, texel(line, i), STORED(before));
        kept = own / diagonal;
        back = on;
        here = next;
    }
}
