// Empty-space skipping: rays skip bricks that cannot change the picture. Samples keep their positions, because skipped steps count.
layout(constant_id = 23) const int SKIP = 0; // 0 take every sample; 1 skip by the kinds of bricks and their distances; 2 by their value ranges

uniform texture3D bricks;
#ifdef TWO_KINDS
uniform texture3D volume_bricks; // the kinds to compositing, where `bricks` are those to the surface detector
#endif

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

// A sample's place among the bricks.
struct BrickPlace {
    float along; // distance from the ray's entry, mm
    vec3 q;      // in bricks
    vec3 cell;
    ivec3 clamped; // the nearest brick
    bool within;
};

// The place of sample i, which is `at` of a step after the beginning of step i.
BrickPlace brick_place(Ray ray, int i, float at) {
    BrickPlace b;
    b.along = offset_of(ray, float(i) + at);
    b.q = (ray.origin + ray.direction * (ray.enter + b.along) - brick_low) * brick_density;
    b.cell = floor(b.q);
    vec3 nearest = clamp(b.cell, vec3(0.0), last_brick);
    b.within = b.cell == nearest;
    b.clamped = ivec3(nearest);
    return b;
}

// The segment from sample i, whose brick has this texel.
RaySegment segment_of(Ray ray, int i, float at, BrickPlace b, vec2 texel) {
    int code = int(texel.x * 255.0 + 0.5);
    // All bricks nearer than this are of one kind.
    int apart = SKIP == 1 ? max(code & 63, 1) : 1;
    vec3 each = ray.direction * brick_density;
    // All that is kept from look-up to look-up: the sign of the quotient is that of the direction.
    vec3 inverse = 1.0 / mix(each, vec3(1e-12), lessThan(abs(each), vec3(1e-12)));
    vec3 ahead = b.cell + mix(vec3(1 - apart), vec3(apart), greaterThan(inverse, vec3(0.0)));
    vec3 steps_ahead = (ahead - b.q) * inverse;
    float steps = steps_to(ray, b.along + min(steps_ahead.x, min(steps_ahead.y, steps_ahead.z))) - at - 1e-3;
    RaySegment s;
    s.kind = b.within && SKIP == 1 ? code >> 6 : ACTIVE;
    s.range = b.within ? texel : vec2(0.0, 1.0);
    s.stop = b.within ? int(floor(clamp(steps, float(i), 1e8))) + 1 : i + 1;
    return s;
}

RaySegment segment_at(Ray ray, int i, float at) {
    BrickPlace b = brick_place(ray, i, at);
    return segment_of(ray, i, at, b, texelFetch(bricks, b.clamped, 0).xy);
}
#ifdef TWO_KINDS
RaySegment volume_segment_at(Ray ray, int i, float at) {
    BrickPlace b = brick_place(ray, i, at);
    return segment_of(ray, i, at, b, texelFetch(volume_bricks, b.clamped, 0).xy);
}
#endif
