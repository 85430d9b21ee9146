// Shared by the solvers of the AOS scheme, along rows (AXIS 0) or columns (AXIS 1). Of slices, an invocation's z is the slice within the batch.
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
layout(constant_id = 0) const int AXIS = 0;
#ifdef PICTURE
#define T vec4
#define STORED(v) (v)
#define LOADED(v) (v)
#define TEXTURE texture2D
#define IMAGE image2D
#define TEXEL ivec2
#else
#define T float
#define STORED(v) vec4(v, 0.0, 0.0, 0.0)
#define LOADED(v) ((v).x)
#define TEXTURE texture2DArray
#define IMAGE image2DArray
#define TEXEL ivec3
#endif
TEXEL texel(int line, int i) {
    ivec2 at = AXIS == 0 ? ivec2(i, line) : ivec2(line, i);
#ifdef PICTURE
    return at;
#else
    return ivec3(at, gl_GlobalInvocationID.z);
#endif
}
