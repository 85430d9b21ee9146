// The cut faces of clip planes: the echo where a ray enters the kept part of the volume through a clip plane, if there is tissue. Means over
// parts of a disc of the face decide it, so that single grains of speckle neither pierce the face of tissue nor lie in fluid.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float level;  // echo from which a place is tissue, before the window
    float radius; // of the disc, mm
    float fade_density; // 1 / length over which the face fades towards the faces of the region, 1/mm
};
#include "ray.glsl"
#include "region_fade.glsl"
#include "kept.glsl"
uniform writeonly image2D cap; // echo after the window; opacity of the face

// Places of the disc, shares of the radius along the axes of the face: twelve at its rim, every 30 degrees, and six half-way to the middle.
const int RIM = 12, INNER = 6;
const vec2 AROUND[RIM + INNER] = vec2[](
    vec2(1.0, 0.0), vec2(0.8660254, 0.5), vec2(0.5, 0.8660254), vec2(0.0, 1.0), vec2(-0.5, 0.8660254), vec2(-0.8660254, 0.5),
    vec2(-1.0, 0.0), vec2(-0.8660254, -0.5), vec2(-0.5, -0.8660254), vec2(0.0, -1.0), vec2(0.5, -0.8660254), vec2(0.8660254, -0.5),
    vec2(0.5, 0.0), vec2(0.25, 0.4330127), vec2(-0.25, 0.4330127), vec2(-0.5, 0.0), vec2(-0.25, -0.4330127), vec2(0.25, -0.4330127)
);

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(cap)))) return;
    int face;
    Ray ray = ray_of(pixel, face);
    vec2 cut = vec2(0.0);
    vec3 p = place_at(ray, 0.0), texel;
    if (face >= 0 && ray.leave > ray.enter && locate(p, texel)) {
        float echo = raw_volume(texel);
        // Axes of the face (Duff et al. 2017, Building an orthonormal basis, revisited).
        vec3 n = clip_at(face).xyz;
        float side = n.z < 0.0 ? -1.0 : 1.0, scale = -1.0 / (side + n.z), both = n.x * n.y * scale;
        vec3 u = radius * vec3(1.0 + side * n.x * n.x * scale, side * both, -side * n.x);
        vec3 v = radius * vec3(both, side + n.y * n.y * scale, -n.y);
        // Sums of echoes, and their numbers.
        vec2 rim[RIM], inner = vec2(echo, 1.0);
        for (int i = 0; i < RIM + INNER; ++i) {
            vec3 beside = p + u * AROUND[i].x + v * AROUND[i].y;
            vec2 there = vec2(0.0);
            if (is_kept(beside, face) && locate(beside, texel)) there = vec2(raw_volume(texel), 1.0);
            if (i < RIM) rim[i] = there;
            else inner += there;
        }
        float mean = inner.x / inner.y, least = mean, most = mean;
        for (int i = 0; i < RIM; i += 2) {
            vec2 part = rim[i] + rim[i + 1] + rim[(i + RIM - 1) % RIM];
            if (part.y > 0.0) {
                least = min(least, part.x / part.y);
                most = max(most, part.x / part.y);
            }
        }
        // Where the disc reaches into fluid, the face ends in the middle of the edge, as the surface does.
        if (mean >= level && (least >= level || mean >= 0.5 * (least + most))) cut = vec2(windowed(echo), faded(p));
    }
    imageStore(cap, pixel, vec4(cut, 0.0, 0.0));
}
