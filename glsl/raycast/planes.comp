// MPR: each pixel shows a point of its tile's plane, or the mean, largest or smallest value of a slab around it. No ray is cast.
// TONED: writes the final 8 bits directly, where stage 4 only tones.
// variants: plain; uniform SWEPT; intra_frame_motion SWEPT INTRA_FRAME_MOTION; non_uniform SWEPT NON_UNIFORM; non_uniform_intra_frame_motion SWEPT NON_UNIFORM INTRA_FRAME_MOTION; toned_plain TONED LINES; toned_uniform TONED LINES SWEPT; toned_intra_frame_motion TONED LINES SWEPT INTRA_FRAME_MOTION; toned_non_uniform TONED LINES SWEPT NON_UNIFORM; toned_non_uniform_intra_frame_motion TONED LINES SWEPT NON_UNIFORM INTRA_FRAME_MOTION
#version 460
#include "common.glsl"
layout(constant_id = 3) const int SAMPLES = 1; // through the slab
layout(constant_id = 4) const int SLAB = 0;    // 0 mean, 1 largest, 2 smallest
#ifdef TONED
#include "tone_constants.glsl"
#endif
layout(scalar) uniform Params {
#include "ray_params.glsl"
    int columns;
    int rows;
#ifdef TONED
#include "tone_params.glsl"
    float line_strength; // 0..1
#endif
};
#include "ray.glsl"
#include "tiles.glsl"
#ifdef TONED
#include "tone.glsl"
uniform writeonly image2D screen;
#define TARGET screen
#else
uniform writeonly image2D picture;
#define TARGET picture
#endif

// True inside the rendered box and on the near side of every clip plane.
bool is_kept(vec3 p) {
    bool kept = all(greaterThanEqual(p, box_low)) && all(lessThanEqual(p, box_high));
    for (int i = 0; i < CLIPS; ++i) {
        vec4 plane = i == 0 ? clip_0 : i == 1 ? clip_1 : i == 2 ? clip_2 : clip_3;
        kept = kept && dot(plane.xyz, p) <= plane.w;
    }
    return kept;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(TARGET), cells = ivec2(columns, rows);
    if (any(greaterThanEqual(pixel, size))) return;
    ivec2 cell = cell_of(pixel, size, cells);
    int n = cell.y * columns + cell.x;
    float value = SLAB == 2 ? 1.0 : 0.0;
    int count = 0;
    if (n < tile_count()) {
        vec2 at = vec2(pixel - cell_corner(cell, size, cells)) + 0.5;
        vec3 middle = tile_corner(n) + tile_dx(n) * at.x + tile_dy(n) * at.y;
        for (int i = 0; i < SAMPLES; ++i) {
            float through = SAMPLES > 1 ? float(i) / float(max(SAMPLES - 1, 1)) - 0.5 : 0.0;
            vec3 p = SAMPLES > 1 ? middle + tile_slab(n) * through : middle;
            vec3 texel;
            if (!is_kept(p) || !locate(p, texel)) continue;
            float v = sample_volume(texel);
            value = SLAB == 0 ? value + v : SLAB == 1 ? max(value, v) : min(value, v);
            ++count;
        }
    }
    if (SLAB == 0) value /= float(max(count, 1));
#ifdef TONED
    vec3 c = count > 0 ? toned(vec3(value)) : vec3(0.0);
    imageStore(TARGET, pixel, vec4(with_lines(c, pixel, size), 1.0));
#else
    imageStore(TARGET, pixel, count > 0 ? vec4(vec3(value), 1.0) : vec4(0.0));
#endif
}
