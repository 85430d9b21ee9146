// What slices are stored to: the 3D texture, or the layers that filters read next. Of layers, the image is rewritten to an array when
// a pipeline is made; an invocation's z is the slice within the batch, and the layer.
layout(constant_id = 40) const int LAYERED = 0; // 1: the target is an array of layers
#include "stored_volume.glsl"
uniform writeonly image3D target;
ivec3 place_in_target(ivec3 at) { return LAYERED == 1 ? at : at + ivec3(0, 0, slice) - first_stored; }
