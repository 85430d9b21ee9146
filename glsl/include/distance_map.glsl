// The distance map in space: positions and normals of the surface at each pixel.
uniform texture2D distance_map;

vec3 ray_direction(vec2 at) { return normalize(direction + direction_dx * at.x + direction_dy * at.y); }
vec3 ray_origin(vec2 at) { return origin + origin_dx * at.x + origin_dy * at.y; }

float distance_at(ivec2 pixel) {
    ivec2 size = textureSize(distance_map, 0);
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) return MISS;
    return texelFetch(distance_map, pixel, 0).x;
}

// Displacement over one pixel along `along`: central where both neighbours belong to the same surface, one-sided where one does,
// and that of a plane facing the viewer where none does. No difference is taken across a cliff.
vec3 slope(ivec2 pixel, ivec2 along, float here, vec3 facing) {
    float back = distance_at(pixel - along), on = distance_at(pixel + along);
    bool use_back = abs(back - here) <= cliff, use_on = abs(on - here) <= cliff;
    if (!use_back && !use_on) return facing;
    ivec2 first = use_back ? pixel - along : pixel, second = use_on ? pixel + along : pixel;
    float near = use_back ? back : here, far = use_on ? on : here;
    vec3 first_ray = ray_direction(vec2(first) + 0.5), second_ray = ray_direction(vec2(second) + 0.5);
    vec2 steps = vec2(second - first);
    // The difference of two positions, term by term: subtracting the positions would cancel most of f32's digits.
    return origin_dx * steps.x + origin_dy * steps.y + second_ray * (far - near) + (second_ray - first_ray) * near;
}

// Unit normal at a pixel with a surface, towards the viewer.
vec3 normal_at(ivec2 pixel, float here, vec3 along_ray) {
    // The pixel's axes in space at unit distance, for a surface that faces the viewer.
    vec3 sx = slope(pixel, ivec2(1, 0), here, origin_dx + direction_dx);
    vec3 sy = slope(pixel, ivec2(0, 1), here, origin_dy + direction_dy);
    vec3 normal = cross(sy, sx);
    float size = length(normal);
    normal = size > 1e-30 ? normal / size : -along_ray;
    return dot(normal, along_ray) > 0.0 ? -normal : normal;
}
