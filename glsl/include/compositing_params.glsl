    float absorption_scale; // step divided by the length that opacities refer to
    float opaque_enough;    // a ray ends at this opacity
    vec3 near_tint;
    vec3 far_tint;
    vec3 depth_axis; // depth along the view: dot(place, axis) - depth_near is 0 at the nearest, 1 at the farthest
    float depth_near;
