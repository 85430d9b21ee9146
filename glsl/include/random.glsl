// Counter-based random numbers (Salmon et al. 2011): a function of pixel, sample, seed and the number of the draw, so that no division into
// dispatches changes them. The hash is pcg4d (Jarzynski and Olano 2020).
uvec4 pcg4d(uvec4 v) {
    v = v * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> 16;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Four uniform numbers of 24 bits in 0..1, without 1. The last component of the stream counts draws.
vec4 draw(inout uvec4 stream) {
    vec4 u = vec4(pcg4d(stream) >> 8) * (1.0 / 16777216.0);
    ++stream.w;
    return u;
}
