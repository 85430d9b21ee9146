// VR: emission and absorption, front to back (thesis 4-1, 4-2).
// variants: plain; even SWEPT; moved SWEPT MOVED; uneven SWEPT UNEVEN; uneven_moved SWEPT UNEVEN MOVED
#version 460
#include "common.glsl"
layout(constant_id = 3) const int EARLY_END = 1;
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float absorption_scale; // step over the length that opacities are given for
    float opaque_enough;    // a ray ends at this opacity
};
#include "ray.glsl"
readonly buffer TransferTable { vec4 entry[]; } transfer;
uniform writeonly image2D picture;

// 1 - exp(-y) without losing a small y: seven terms of the Taylor series below one half.
float opacity_of(float y) {
    float series = y * (1.0 - y / 2.0 * (1.0 - y / 3.0 * (1.0 - y / 4.0 * (1.0 - y / 5.0 * (1.0 - y / 6.0 * (1.0 - y / 7.0))))));
    return y < 0.5 ? series : 1.0 - exp(-y);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    Ray ray = ray_of(pixel);
    float path = ray.leave - ray.enter;
    vec3 colour = vec3(0.0);
    float opacity = 0.0;
    if (path > 0.0) {
        int whole = int(path / step_length);
        for (int i = 0; i <= whole; ++i) {
            // Midpoints of the steps; the last step is as long as what is left.
            float length = min(step_length, path - float(i) * step_length);
            vec3 p = ray.origin + ray.direction * (ray.enter + float(i) * step_length + 0.5 * length);
            vec3 texel;
            if (length <= 0.0 || !locate(p, texel)) continue;
            float e = sample_volume(texel) * float(transfer.entry.length() - 1);
            int n = min(int(e), transfer.entry.length() - 2);
            vec4 entry = mix(transfer.entry[n], transfer.entry[n + 1], e - float(n));
            float a = opacity_of(entry.a * absorption_scale * (length / step_length));
            colour += (1.0 - opacity) * a * entry.rgb;
            opacity += (1.0 - opacity) * a;
            if (EARLY_END == 1 && opacity >= opaque_enough) break;
        }
    }
    imageStore(picture, pixel, vec4(colour, opacity));
}
