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
uniform writeonly image2D cap; // echo after the window; opacity of the face

// Places of the disc, shares of the radius along the axes of the face: twelve at its rim, every 30 degrees, and six half-way to the middle.
const int RIM = 12, INNER = 6;
const vec2 AROUND[RIM + INNER] = vec2[](
    vec2(1.0, 0.0), vec2(0.8660254, 0.5), vec2(0.5, 0.8660254), vec2(0.0, 1.0), vec2(-0.5, 0.8660254), vec2(-0.8660254, 0.5),
    vec2(-1.0, 0.0), vec2(-0.8660254, -0.5), vec2(-0.5, -0.8660254), vec2(0.0, -1.0), vec2(0.5, -0.8660254), vec2(0.8660254, -0.5),
    vec2(0.5, 0.0), vec2(0.25, 0.4330127), vec2(-0.25, 0.4330127), vec2(-0.5, 0.0), vec2(-0.25, -0.4330127), vec2(0.25, -0.4330127)
);

vec4 clip_at(int i) { return i == 0 ? clip_0 : i == 1 ? clip_1 : i == 2 ? clip_2 : clip_3; }

// True inside the rendered box and on the near side of every clip plane but one, on which the place lies.
bool is_on_face(vec3 p, int face) {
    bool kept = all(greaterThanEqual(p, box_low)) && all(lessThanEqual(p, box_high));
    for (int i = 0; i < CLIPS; ++i) kept = kept && (i == face || dot(clip_at(i).xyz, p) <= clip_at(i).w);
    return kept;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(cap)))) return;
    vec2 at = vec2(pixel) + 0.5;
    vec3 from = origin + origin_dx * at.x + origin_dy * at.y;
    vec3 along = normalize(direction + direction_dx * at.x + direction_dy * at.y);
    // As `ray_of`, with the clip plane that the ray enters last.
    vec3 d = mix(along, vec3(1e-12), lessThan(abs(along), vec3(1e-12)));
    vec3 a = (box_low - from) / d;
    vec3 b = (box_high - from) / d;
    vec3 near = min(a, b), far = max(a, b);
    float enter = max(max(near.x, near.y), max(near.z, 0.0)), leave = min(far.x, min(far.y, far.z));
    int face = -1;
    for (int i = 0; i < CLIPS; ++i) {
        vec4 plane = clip_at(i);
        float towards = dot(plane.xyz, along);
        float clearance = plane.w - dot(plane.xyz, from);
        if (abs(towards) < 1e-12) leave = clearance < 0.0 ? -1.0 : leave;
        else if (towards > 0.0) leave = min(leave, clearance / towards);
        else if (clearance / towards > enter) {
            enter = clearance / towards;
            face = i;
        }
    }
    vec2 cut = vec2(0.0);
    vec3 p = from + along * enter, texel;
    if (face >= 0 && leave > enter && locate(p, texel)) {
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
            if (is_on_face(beside, face) && locate(beside, texel)) there = vec2(raw_volume(texel), 1.0);
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
