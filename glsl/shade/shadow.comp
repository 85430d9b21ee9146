// Shadow by tracing the distance map towards the light (thesis Fig. 41): a place on the way lies in matter where the map says
// that its pixel sees something nearer. A soft edge widens with the distance to what casts it.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int POINT = 0;
layout(constant_id = 1) const int PERSPECTIVE = 0;
layout(constant_id = 2) const int SOFT = 1;
layout(constant_id = 3) const int STEPS = 96;
layout(scalar) uniform Params {
#include "camera_params.glsl"
    vec3 forward;
    vec3 light_at;
    float reach;     // mm
    float thickness; // mm
    float bias;      // mm
    float softness;  // mm of edge a mm
};
#include "distance_map.glsl"
uniform writeonly image2D shadow;

// Pixel place of a place in space, and its distance along that pixel's ray.
vec3 seen_at(vec3 place) {
    vec3 way = place - origin;
    if (PERSPECTIVE == 1) {
        float depth = dot(way, forward);
        vec3 across = way / max(depth, 1e-6) - direction;
        vec2 at = vec2(dot(across, direction_dx) / dot(direction_dx, direction_dx), dot(across, direction_dy) / dot(direction_dy, direction_dy));
        return vec3(at, depth > 1e-6 ? length(way) : -1.0);
    }
    vec2 at = vec2(dot(way, origin_dx) / dot(origin_dx, origin_dx), dot(way, origin_dy) / dot(origin_dy, origin_dy));
    return vec3(at, dot(way, forward));
}

// The distance map between pixel centres; only what belongs to one surface is interpolated.
float map_at(vec2 at) {
    vec2 place = at - 0.5;
    ivec2 base = ivec2(floor(place));
    vec2 w = place - vec2(base);
    float a = distance_at(base), b = distance_at(base + ivec2(1, 0));
    float c = distance_at(base + ivec2(0, 1)), d = distance_at(base + ivec2(1, 1));
    float low = min(min(a, b), min(c, d)), high = max(max(a, b), max(c, d));
    if (high - low > cliff) return distance_at(ivec2(floor(at)));
    // Differences from one of them: f32 keeps its digits.
    return low + mix(mix(a - low, b - low, w.x), mix(c - low, d - low, w.x), w.y);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(shadow)))) return;
    float distance = distance_at(pixel);
    float arrives = 1.0;
    if (is_hit(distance)) {
        vec2 at = vec2(pixel) + 0.5;
        vec3 place = ray_origin(at) + ray_direction(at) * distance;
        vec3 to_light = light_at;
        float way = reach;
        if (POINT == 1) {
            to_light = light_at - place;
            float far = length(to_light);
            to_light = far > 1e-6 ? to_light / far : -ray_direction(at);
            way = min(reach, far);
        }
        float stride = way / float(STEPS);
        vec2 size = vec2(textureSize(distance_map, 0));
        for (int i = 1; i <= STEPS; ++i) {
            float gone = float(i) * stride;
            vec3 seen = seen_at(place + to_light * gone);
            if (any(lessThan(seen.xy, vec2(0.0))) || any(greaterThanEqual(seen.xy, size)) || seen.z < 0.0) break;
            float nearest = map_at(seen.xy);
            // How far behind the surface the place lies; a miss is far in front of nothing.
            float inside = is_hit(nearest) ? seen.z - nearest - bias : -1e6;
            if (inside > thickness) continue;
            float blocked = SOFT == 1 ? clamp(0.5 + inside / (softness * gone), 0.0, 1.0) : (inside > 0.0 ? 1.0 : 0.0);
            arrives = min(arrives, 1.0 - blocked);
            if (arrives <= 0.0) break;
        }
    }
    imageStore(shadow, pixel, vec4(arrives, 0.0, 0.0, 0.0));
}
