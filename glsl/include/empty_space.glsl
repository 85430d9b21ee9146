// Empty-space skipping: rays skip bricks that cannot change the picture. Samples keep their positions, because skipped steps count.
layout(constant_id = 23) const int SKIP = 0; // 0 take every sample; 1 skip by the kinds of bricks and their distances; 2 by their value ranges

uniform texture3D bricks;

// Samples between two look-ups of a brick. The count is the same for all rays, because the rays of a subgroup wait for the one that
// takes most samples.
const int SAMPLES_PER_LOOKUP = 16;

const int ACTIVE = 0, EMPTY = 1, HOMOGENEOUS = 2; // kinds, as in classify.comp

// The part of a ray that is in bricks of one kind: from a sample up to `stop`, the first that may be in another kind.
struct RaySegment {
    int kind;
    vec2 range;
    int stop;
};

// The segment from sample i, which is `at` of a step after the beginning of step i.
RaySegment segment_at(Ray ray, int i, float at) {
    float along = offset_of(ray, float(i) + at);
    vec3 q = (ray.origin + ray.direction * (ray.enter + along) - brick_low) * brick_density;
    ivec3 size = textureSize(bricks, 0);
    ivec3 cell = ivec3(floor(q));
    bool within = all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, size));
    vec2 texel = texelFetch(bricks, clamp(cell, ivec3(0), size - 1), 0).xy;
    int code = int(texel.x * 255.0 + 0.5);
    // All bricks nearer than this are of one kind.
    int apart = SKIP == 1 ? max(code & 63, 1) : 1;
    vec3 each = ray.direction * brick_density;
    vec3 d = mix(each, vec3(1e-12), lessThan(abs(each), vec3(1e-12)));
    vec3 ahead = vec3(cell) + mix(vec3(1 - apart), vec3(apart), greaterThan(d, vec3(0.0)));
    vec3 steps_ahead = (ahead - q) / d;
    float steps = steps_to(ray, along + min(steps_ahead.x, min(steps_ahead.y, steps_ahead.z))) - at - 1e-3;
    RaySegment s;
    s.kind = within && SKIP == 1 ? code >> 6 : ACTIVE;
    s.range = within ? texel : vec2(0.0, 1.0);
    s.stop = within ? int(floor(clamp(steps, float(i), 1e8))) + 1 : i + 1;
    return s;
}
