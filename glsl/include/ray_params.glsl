#include "ray_block.glsl"
    // What is rendered, mm.
    vec3 box_low;
    vec3 box_high;
    float step_length; // mm
    float spread;       // 0: even steps, 1: in proportion to the range
    float spread_range; // mm at which a step is not longer yet
    vec4 clip_0; // what lies beyond is cut away: dot(xyz, p) > w
    vec4 clip_1;
    vec4 clip_2;
    vec4 clip_3;
    vec3 brick_low;     // corner of the first brick, mm
    vec3 brick_density; // bricks a mm
    float window_low;
    float window_scale;
    // Space to texture.
    vec2 grid_origin;  // in-plane mm of pixel (0, 0)
    vec2 grid_density; // pixels a mm
    float slice_origin; // Cartesian: mm of slice 0
    float slice_density;
    // The sector: ranges in mm, lines as half tangents (curved) or mm (linear).
    float range_low;
    float range_high;
    float line_low;
    float line_high;
    float axis_depth; // Y of the wobble axis, mm
    // The sweep look-up table: slice position, as half tangent (fan) or mm, to slice index.
    float sweep_low;
    float sweep_density;
    float line_density; // entries of the line look-up table
    float advance;      // slices that the motor travels over the lines of a frame
