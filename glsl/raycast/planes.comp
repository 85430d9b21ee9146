// MPR: each pixel shows a point of its tile's plane, or the mean, largest or smallest value of a slab around it. No ray is cast.
// TONED: writes the final 8 bits directly, where stage 4 only tones.
// variants: plain; toned TONED
#version 460
#include "common.glsl"
layout(constant_id = 3) const int SAMPLES = 1; // through the slab
layout(constant_id = 4) const int SLAB = 0;    // 0 mean, 1 largest, 2 smallest
// 1: one plane fills the picture. Its vectors are those of the rays: a CPU reads tables lane by lane, which takes nearly as long as a sample.
layout(constant_id = 5) const int ONE_TILE = 0;
// 1: the last tile is a curved plane, which has a place and a slab for each column.
layout(constant_id = 6) const int CURVED = 0;
layout(constant_id = 7) const int RUN = 1; // pixels of a column that an invocation makes: a CPU loads all parameters for every eight invocations
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
// For each column the place at the upper edge of the tile, w 0 beyond the ends of the line; and from the slab's near face to its far one.
readonly buffer CurveColumns { vec4 entry[]; } curve_columns;
#ifdef TONED
#include "tone.glsl"
#include "cross_lines.glsl"
uniform writeonly image2D screen;
#define TARGET screen
#else
uniform writeonly image2D picture;
#define TARGET picture
#endif

#include "kept.glsl"

void make(ivec2 pixel, ivec2 size) {
    vec3 corner = origin, dx = origin_dx, dy = origin_dy, slab = direction;
    ivec2 first = ivec2(0);
    bool is_covered = true, is_curved = false;
    if (ONE_TILE == 0) {
        ivec2 cells = ivec2(columns, rows), cell = cell_of(pixel, size, cells);
        int n = cell.y * columns + cell.x;
        first = cell_corner(cell, size, cells);
        is_covered = n < tile_count();
        is_curved = n == tile_count() - 1;
        corner = tile_corner(n);
        dx = tile_dx(n);
        dy = tile_dy(n);
        slab = tile_slab(n);
    }
    float value = SLAB == 2 ? 1.0 : 0.0;
    int count = 0;
    vec2 at = vec2(pixel - first) + 0.5;
    if (CURVED == 1 && is_curved) {
        int column = 2 * (pixel.x - first.x);
        vec4 top = curve_columns.entry[column];
        is_covered = top.w > 0.0;
        corner = top.xyz;
        dx = vec3(0.0);
        slab = curve_columns.entry[column + 1].xyz;
    }
    if (is_covered) {
        vec3 middle = corner + dx * at.x + dy * at.y;
        for (int i = 0; i < SAMPLES; ++i) {
            float through = SAMPLES > 1 ? float(i) / float(max(SAMPLES - 1, 1)) - 0.5 : 0.0;
            vec3 p = SAMPLES > 1 ? middle + slab * through : middle;
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
    imageStore(TARGET, pixel, vec4(ONE_TILE == 0 ? with_lines(c, pixel, size) : c, 1.0));
#else
    imageStore(TARGET, pixel, count > 0 ? vec4(vec3(value), 1.0) : vec4(0.0));
#endif
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) * ivec2(1, RUN);
    ivec2 size = imageSize(TARGET);
    if (pixel.x >= size.x) return;
    int end = min(pixel.y + RUN, size.y);
    for (; pixel.y < end; ++pixel.y) make(pixel, size);
}
