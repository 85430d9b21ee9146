    float absorption_scale; // step divided by the length that opacities refer to
    float opaque_enough;    // a ray ends at this opacity
    vec3 near_tint;
    vec3 far_tint;
    vec3 depth_axis; // depth along the view: dot(place, axis) - depth_near is 0 at the nearest, 1 at the farthest
    float depth_near;
    float fade_density; // 1 / length over which matter fades towards the faces of the region, 1/mm
    vec3 light_low;      // corner of the first cell of the light volume, mm
    float light_density; // cells per mm
    vec3 light_towards;  // unit direction to the light
    vec3 light_colour;
    float specular;
    float shininess;
    float exposure;
    vec3 ground_middle;
    vec3 ground_edge;
