// Shadow by tracing the distance map towards the light (thesis Fig. 41). A sample on the segment to the light is in matter
// where the map has a nearer surface at the sample's pixel. A soft edge widens with the distance to the occluder.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int POINT = 0;
layout(constant_id = 1) const int PERSPECTIVE = 0;
layout(constant_id = 2) const int SOFT = 1;
layout(constant_id = 3) const int MOST_STEPS = 2048;
layout(scalar) uniform Params {
#include "camera_params.glsl"
    vec3 forward;
    vec3 light_at;
    float reach;     // mm; no obstacle in the picture is further away than this
    vec2 pitch;      // stride across the view: pixels' size in mm, and per mm of distance
    float thickness; // mm
    float bias;      // mm
    float softness;  // mm of edge per mm
    float growth;    // of SOFT: stride per mm of distance to the surface, mm
};
#include "distance_map.glsl"
uniform writeonly image2D shadow;

// A way through space as it runs in the picture, with all that is the same for each of its places.
struct Way {
    vec2 at;     // where it begins, pixels
    vec2 drift;  // pixels per mm; in perspective times depth
    float depth; // of its beginning, and per mm of the way, mm along `forward`
    float towards;
    float along; // of the vector from the eye to its beginning: mm along the way, and the square of its length
    float square;
};

vec2 in_pixels(vec3 v) {
    vec3 dx = PERSPECTIVE == 1 ? direction_dx : origin_dx, dy = PERSPECTIVE == 1 ? direction_dy : origin_dy;
    return vec2(dot(v, dx) / dot(dx, dx), dot(v, dy) / dot(dy, dy));
}

Way way_from(vec2 at, vec3 place, vec3 along) {
    vec3 offset = place - origin;
    Way way = Way(at, in_pixels(along), dot(offset, forward), dot(along, forward), dot(offset, along), dot(offset, offset));
    // What an approach to the eye does to the pixel where the way begins.
    if (PERSPECTIVE == 1) way.drift -= way.towards * (at + in_pixels(direction));
    return way;
}

// The pixel coordinates of the place so many mm on, and its distance along that pixel's ray.
vec3 place_on(Way way, float gone) {
    float depth = way.depth + way.towards * gone;
    if (PERSPECTIVE == 0) return vec3(way.at + way.drift * gone, depth);
    float far = sqrt(max(way.square + gone * (2.0 * way.along + gone), 0.0));
    return vec3(way.at + way.drift * (gone / max(depth, 1e-30)), depth > 0.0 ? far : -1.0);
}

float fetched(int x, int y) { return texelFetch(distance_map, ivec2(x, y), 0).x; }

// The distance map between pixel centres, at a place within the picture. Only pixels of the same surface are interpolated.
float map_at(vec2 at) {
    vec2 place = at - 0.5;
    ivec2 base = ivec2(floor(place)), next = base + 1;
    vec2 w = place - vec2(base);
    // All four are loaded, without a branch for each: at the border there are no four.
    ivec2 from = max(base, ivec2(0)), to = min(next, textureSize(distance_map, 0) - 1);
    float a = fetched(from.x, from.y), b = fetched(to.x, from.y), c = fetched(from.x, to.y), d = fetched(to.x, to.y);
    float low = min(min(a, b), min(c, d)), high = max(max(a, b), max(c, d));
    if (from != base || to != next || high - low > cliff) return fetched(int(at.x), int(at.y));
    // Differences from the smallest keep f32's digits.
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
        float length_to_light = reach;
        if (POINT == 1) {
            to_light = light_at - place;
            float far = length(to_light);
            to_light = far > 1e-7 * distance ? to_light / far : -ray_direction(at);
            length_to_light = min(reach, far);
        }
        // Whatever the reach, so that a longer one never loses an obstacle.
        float across = length(cross(to_light, ray_direction(at)));
        float pixel_size = pitch.x + pitch.y * distance;
        float stride = max(min(pixel_size / max(across, 1e-6), 0.5 * thickness / max(sqrt(max(1.0 - across * across, 0.0)), 1e-6)), 0.25 * pixel_size);
        vec2 size = vec2(textureSize(distance_map, 0));
        Way way = way_from(at, place, to_light);
        float travelled = 0.0;
        for (int i = 0; i < MOST_STEPS; ++i) {
            travelled += SOFT == 1 ? max(stride, growth * travelled) : stride;
            if (travelled > length_to_light) break;
            vec3 pixel_place = place_on(way, travelled);
            if (any(lessThan(pixel_place.xy, vec2(0.0))) || any(greaterThanEqual(pixel_place.xy, size)) || pixel_place.z < 0.0) break;
            float nearest = map_at(pixel_place.xy);
            // Depth of the sample behind the surface. A miss blocks nothing.
            float inside = is_hit(nearest) ? pixel_place.z - nearest - bias : -MISS;
            if (inside > thickness) continue;
            float blocked = SOFT == 1 ? clamp(0.5 + inside / (softness * travelled), 0.0, 1.0) : (inside > 0.0 ? 1.0 : 0.0);
            arrives = min(arrives, 1.0 - blocked);
            if (arrives <= 0.0) break;
        }
    }
    imageStore(shadow, pixel, vec4(arrives, 0.0, 0.0, 0.0));
}
