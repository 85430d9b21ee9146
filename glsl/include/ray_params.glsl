#include "ray_block.glsl"
    // The rendered box, mm.
    vec3 box_low;
    vec3 box_high;
    float step_length; // mm
    float spread;       // 0: uniform steps, 1: proportional to the range
    float spread_range; // range up to which steps have their shortest length, mm
    vec4 clip_0; // points with dot(xyz, p) > w are cut away
    vec4 clip_1;
    vec4 clip_2;
    vec4 clip_3;
    vec3 brick_low;     // corner of the first brick, mm
    vec3 brick_density; // bricks per mm
    vec3 last_brick;    // on each axis
    // The texel of the volume that its image and that of packed neighbours begin with.
    int first_stored_column;
    int first_stored_row;
    int first_stored_slice;
    // And the one that they end with.
    int last_stored_column;
    int last_stored_row;
    int last_stored_slice;
    // From texture indices to the coordinates of the device's filter: (index + shift) * scale.
    vec3 texture_shift;
    vec3 texture_scale;
    float last_slice; // of the volume
    float window_low;
    float window_scale;
    // Space to texture.
    vec2 grid_origin;  // in-plane mm of pixel (0, 0)
    vec2 grid_density; // pixels per mm
    float slice_origin; // Cartesian: mm of slice 0
    float slice_density;
    // The sector: ranges in mm, lines as half tangents (curved) or mm (linear).
    float range_low;
    float range_high;
    float range_low_squared;
    float range_high_squared;
    float line_low;
    float line_high;
    float axis_depth; // Y of the wobble axis, mm
    vec2 first_line; // in-plane normals of the first and the last line, towards the others
    vec2 last_line;
    // Slice position, as half tangent (fan) or mm, to slice index: by a polynomial, or by a look-up table.
    float sweep_first; // exact limits of the sweep
    float sweep_last;
    float sweep_border_low; // of what counts as inside: a little beyond
    float sweep_border_high;
    float sweep_low;   // the same, or for a polynomial a little beyond
    float sweep_high;
    float sweep_density; // entries of the table
    float sweep_offset;
    vec4 sweep_terms_0;
    vec4 sweep_terms_1;
    vec2 sweep_terms_2;
    float line_density; // entries of the line look-up table
    float advance;      // slices that the motor travels over the lines of a frame
