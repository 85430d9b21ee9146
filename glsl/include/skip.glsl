// Bricks that cannot change the picture are leapt over. Samples keep their places: step numbers count on, whatever is left out.
layout(constant_id = 23) const int SKIP = 0; // 0 every sample is taken; 1 by the kinds of bricks and their distances; 2 by their ranges

uniform texture3D bricks;

// Samples taken before bricks are looked at again: as many on all rays, whatever each one's brick asks for, since rays that run side
// by side on one unit wait for the one that takes most.
const int BLOCK = 16;

const int WANTED = 0, NOTHING = 1, KNOWN = 2; // kinds, as classify.comp has them

// What a sample meets, and the first sample behind it that may meet something else.
struct Stretch {
    int kind;
    vec2 range;
    int stop;
};

// Of sample i, `at` of a step behind the beginning of step i.
Stretch stretch_at(Ray ray, int i, float at) {
    float along = offset_of(ray, float(i) + at);
    vec3 q = (ray.origin + ray.direction * (ray.enter + along) - brick_low) * brick_density;
    ivec3 size = textureSize(bricks, 0);
    ivec3 cell = ivec3(floor(q));
    bool within = all(greaterThanEqual(cell, ivec3(0))) && all(lessThan(cell, size));
    vec2 texel = texelFetch(bricks, clamp(cell, ivec3(0), size - 1), 0).xy;
    int code = int(texel.x * 255.0 + 0.5);
    // All bricks nearer than that are of one kind.
    int apart = SKIP == 1 ? max(code & 63, 1) : 1;
    vec3 each = ray.direction * brick_density;
    vec3 d = mix(each, vec3(1e-12), lessThan(abs(each), vec3(1e-12)));
    vec3 ahead = vec3(cell) + mix(vec3(1 - apart), vec3(apart), greaterThan(d, vec3(0.0)));
    vec3 way = (ahead - q) / d;
    float steps = steps_to(ray, along + min(way.x, min(way.y, way.z))) - at - 1e-3;
    Stretch s;
    s.kind = within && SKIP == 1 ? code >> 6 : WANTED;
    s.range = within ? texel : vec2(0.0, 1.0);
    s.stop = within ? int(floor(clamp(steps, float(i), 1e8))) + 1 : i + 1;
    return s;
}
