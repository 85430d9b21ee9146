// Parts of the volume that float, lowered below what is drawn; all else as it is. All images hold the stored part of the volume.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    float most; // what texels that float have at most
#include "slice_params.glsl"
};
#include "stored_volume.glsl"
uniform texture3D source;
uniform texture3D floating; // 1 in parts that float
uniform writeonly image3D target;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID) + ivec3(first_column, first_row, slice) - first_stored;
    if (any(greaterThanEqual(at, imageSize(target)))) return;
    float value = texelFetch(source, at, 0).x;
    if (texelFetch(floating, at, 0).x > 0.5) value = min(value, most);
    imageStore(target, at, vec4(value, 0.0, 0.0, 0.0));
}
