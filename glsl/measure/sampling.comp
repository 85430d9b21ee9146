// Measures how fast the device takes samples without computing: adjacent pixels, straight through the volume.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int SAMPLING = 0; // 0 the device's filter, 1 eight fetches, 2 one fetch
layout(constant_id = 1) const int SAMPLES = 256;
uniform sampler3D volume;
uniform writeonly image2D picture;

float fetch(ivec3 at) { return texelFetch(volume, at, 0).x; }

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    vec3 texels = vec3(textureSize(volume, 0));
    vec2 across = (vec2(pixel) + 0.5) / vec2(size);
    float sum = 0.0;
    for (int i = 0; i < SAMPLES; ++i) {
        vec3 at = vec3(across, (float(i) + 0.5) / float(SAMPLES));
        if (SAMPLING == 0) {
            sum += textureLod(volume, at, 0.0).x;
        } else {
            vec3 texel = clamp(at * texels - 0.5, vec3(0.0), texels - 1.0);
            ivec3 low = ivec3(texel), high = min(low + 1, ivec3(texels) - 1);
            if (SAMPLING == 2) {
                sum += fetch(low);
                continue;
            }
            vec3 w = texel - vec3(low);
            vec4 near = vec4(fetch(low), fetch(ivec3(high.x, low.yz)), fetch(ivec3(low.x, high.y, low.z)), fetch(ivec3(high.xy, low.z)));
            vec4 far = vec4(fetch(ivec3(low.xy, high.z)), fetch(ivec3(high.x, low.y, high.z)), fetch(ivec3(low.x, high.yz)), fetch(high));
            vec4 plane = mix(near, far, w.z);
            vec2 row = mix(plane.xz, plane.yw, w.x);
            sum += mix(row.x, row.y, w.y);
        }
    }
    float mean = sum / float(SAMPLES);
    imageStore(picture, pixel, vec4(vec3(mean), 1.0));
}
