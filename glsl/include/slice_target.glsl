// A slice of the 3D texture, or a plane that filters read next.
#ifdef SLICE
#include "stored_volume.glsl"
uniform writeonly image3D target;
void write_slice(ivec2 at, float value) { imageStore(target, ivec3(at, slice) - first_stored, vec4(value, 0.0, 0.0, 0.0)); }
#else
uniform writeonly image2D target;
void write_slice(ivec2 at, float value) { imageStore(target, at, vec4(value, 0.0, 0.0, 0.0)); }
#endif
ivec2 made_texel() { return ivec2(gl_GlobalInvocationID.xy) + ivec2(first_column, first_row); }
