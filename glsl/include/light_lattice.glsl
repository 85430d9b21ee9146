// The lattice of the light volume. `at` counts cells; cell n has its centre at n + 0.5.
//
// Eight texels, interpolated in f32; beyond the border the nearest cell repeats. A macro, because a function of a texture could not be
// removed where a scene has no such texture.
#define BETWEEN_CELLS(lattice, at, found) { \
    ivec3 last_cell = textureSize(lattice, 0) - 1; \
    vec3 within = clamp((at) - 0.5, vec3(0.0), vec3(last_cell)); \
    ivec3 low = ivec3(within), high = min(low + 1, last_cell); \
    vec3 share = within - vec3(low); \
    vec4 near = mix(mix(texelFetch(lattice, low, 0), texelFetch(lattice, ivec3(high.x, low.yz), 0), share.x), \
                    mix(texelFetch(lattice, ivec3(low.x, high.y, low.z), 0), texelFetch(lattice, ivec3(high.xy, low.z), 0), share.x), share.y); \
    vec4 far = mix(mix(texelFetch(lattice, ivec3(low.xy, high.z), 0), texelFetch(lattice, ivec3(high.x, low.y, high.z), 0), share.x), \
                   mix(texelFetch(lattice, ivec3(low.x, high.yz), 0), texelFetch(lattice, high, 0), share.x), share.y); \
    found = mix(near, far, share.z); \
}
