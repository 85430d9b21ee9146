// A slice of the 3D texture, or a layer that filters read next. An invocation's z is its slice within the batch.
#ifdef SLICE
#include "stored_volume.glsl"
uniform writeonly image3D target;
void write_slice(ivec3 at, float value) { imageStore(target, at + ivec3(0, 0, slice) - first_stored, vec4(value, 0.0, 0.0, 0.0)); }
#else
uniform writeonly image2DArray target;
void write_slice(ivec3 at, float value) { imageStore(target, at, vec4(value, 0.0, 0.0, 0.0)); }
#endif
ivec3 made_texel() { return ivec3(gl_GlobalInvocationID) + ivec3(first_column, first_row, 0); }
