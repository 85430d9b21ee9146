// The texel of a slice that an invocation makes, and where it goes.
#include "volume_target.glsl"
void write_slice(ivec3 at, float value) { imageStore(target, place_in_target(at), vec4(value, 0.0, 0.0, 0.0)); }
ivec3 made_texel() { return ivec3(gl_GlobalInvocationID) + ivec3(first_column, first_row, 0); }
