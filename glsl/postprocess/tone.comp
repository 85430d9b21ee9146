// Contrast about the middle grey, brightness, gamma, colour map; 8 bits out.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int COLOUR_MAP = 0; // 1: brightness through the map below
layout(scalar) uniform Params {
    float brightness;
    float contrast;
    float exponent; // 1 / gamma
    vec3 map_0;
    vec3 map_1;
    vec3 map_2;
    vec3 map_3;
    vec3 map_4;
};
uniform texture2D picture;
uniform writeonly image2D screen;

vec3 toned(vec3 c) {
    c = clamp((c - 0.5) * contrast + 0.5 + brightness, 0.0, 1.0);
    // pow(0, x) of a driver may be anything that log2(0) * x makes.
    return mix(pow(max(c, vec3(1e-8)), vec3(exponent)), vec3(0.0), lessThanEqual(c, vec3(1e-8)));
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(screen)))) return;
    vec4 lit = texelFetch(picture, pixel, 0);
    // Where nothing was hit the picture stays black, whatever the brightness.
    vec3 c = lit.a > 0.0 ? toned(lit.rgb) : vec3(0.0);
    if (COLOUR_MAP == 1 && lit.a > 0.0) {
        float grey = dot(c, vec3(0.2126, 0.7152, 0.0722)) * 4.0;
        vec3 low = mix(map_0, map_1, clamp(grey, 0.0, 1.0));
        low = mix(low, map_2, clamp(grey - 1.0, 0.0, 1.0));
        low = mix(low, map_3, clamp(grey - 2.0, 0.0, 1.0));
        c = mix(low, map_4, clamp(grey - 3.0, 0.0, 1.0));
    }
    imageStore(screen, pixel, vec4(c, 1.0));
}
