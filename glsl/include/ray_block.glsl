    // Rays, affine in the pixel's coordinates.
    vec3 origin;
    vec3 origin_dx;
    vec3 origin_dy;
    vec3 direction;
    vec3 direction_dx;
    vec3 direction_dy;
