// Shared by the two sweeps of the AOS scheme: one invocation per row (AXIS 0) or per column (AXIS 1).
#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
layout(local_size_x = 64) in;
layout(constant_id = 0) const int AXIS = 0;
#ifdef PICTURE
#define T vec4
#define STORED(v) (v)
#define LOADED(v) (v)
#else
#define T float
#define STORED(v) vec4(v, 0.0, 0.0, 0.0)
#define LOADED(v) ((v).x)
#endif
ivec2 texel(int line, int i) { return AXIS == 0 ? ivec2(i, line) : ivec2(line, i); }
