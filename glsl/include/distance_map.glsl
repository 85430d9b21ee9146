// The distance map in space: positions and normals of the surface at each pixel.
uniform texture2D distance_map;

vec3 ray_direction(vec2 at) { return normalize(direction + direction_dx * at.x + direction_dy * at.y); }
vec3 ray_origin(vec2 at) { return origin + origin_dx * at.x + origin_dy * at.y; }

float distance_at(ivec2 pixel) {
    ivec2 size = textureSize(distance_map, 0);
    if (any(lessThan(pixel, ivec2(0))) || any(greaterThanEqual(pixel, size))) return MISS;
    return texelFetch(distance_map, pixel, 0).x;
}

// Displacement over one pixel along `along`: the mean of those on both sides. No difference is taken across a cliff. A step that is no cliff yet is not a slope
// either: the sides are weighted as in a WENO scheme, by the inverse square of their length, so that the side without the step counts. Between two
// cliffs that rise the same way the pixel lies on a flank as steep as the lower one; between two that do not, it faces the viewer.
vec3 slope(ivec2 pixel, ivec2 along, float here, vec3 along_ray, vec3 origin_step, vec3 direction_step) {
    vec3 facing = origin_step + direction_step * here;
    float alike = dot(facing, facing); // a slope of 45 degrees
    float back = distance_at(pixel - along), on = distance_at(pixel + along);
    float rise = here - back, further = on - here;
    float weight = 1.0 / (alike + rise * rise), other = 1.0 / (alike + further * further);
    weight = abs(rise) <= cliff ? weight * weight : 0.0;
    other = abs(further) <= cliff ? other * other : 0.0;
    if (weight + other == 0.0) {
        if ((rise < 0.0) != (further < 0.0)) return facing;
        weight = abs(rise) <= abs(further) ? 1.0 : 0.0;
        other = 1.0 - weight;
    }
    vec3 back_ray = ray_direction(vec2(pixel - along) + 0.5), on_ray = ray_direction(vec2(pixel + along) + 0.5);
    // The differences of positions, term by term: subtracting the positions would cancel most of f32's digits.
    vec3 from_back = weight > 0.0 ? along_ray * rise + (along_ray - back_ray) * back : vec3(0.0);
    vec3 to_on = other > 0.0 ? on_ray * further + (on_ray - along_ray) * here : vec3(0.0);
    return origin_step + (weight * from_back + other * to_on) / (weight + other);
}

// Unit normal at a pixel with a surface, towards the viewer.
vec3 normal_at(ivec2 pixel, float here, vec3 along_ray) {
    vec3 sx = slope(pixel, ivec2(1, 0), here, along_ray, origin_dx, direction_dx);
    vec3 sy = slope(pixel, ivec2(0, 1), here, along_ray, origin_dy, direction_dy);
    vec3 normal = cross(sy, sx);
    float size = length(normal);
    normal = size > 1e-30 ? normal / size : -along_ray;
    return dot(normal, along_ray) > 0.0 ? -normal : normal;
}
