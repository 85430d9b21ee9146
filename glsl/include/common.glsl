#extension GL_EXT_scalar_block_layout : require
#extension GL_EXT_samplerless_texture_functions : require
// 64 invocations: a multiple of all common subgroup sizes. The shape makes no difference on lavapipe.
layout(local_size_x = 8, local_size_y = 8, local_size_z = 1) in;

// The distance of a ray that hit nothing: the largest finite float. Shaders need not preserve infinities and NaN.
const float MISS = 3.402823466e38;
bool is_hit(float distance) { return distance < 3.0e38; }
