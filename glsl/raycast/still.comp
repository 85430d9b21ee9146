// A still: paths of light through the volume, from the camera to the lights. Collisions are sampled by delta tracking (Woodcock et al. 1965) with the
// majorants of bricks; transmittance to a light is estimated by ratio tracking (Novak, Selle and Jarosz 2014). See docs/numerics.md.
#version 460
#include "common.glsl"
layout(constant_id = 29) const int ENTRIES = 256; // of the medium
layout(constant_id = 41) const int BRICKS = 0; // 1: each brick has a majorant
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float fade_density; // 1 / length over which matter fades towards the faces of the region, 1/mm
    int first_sample;
    int samples; // of this dispatch
    int seed;
    int events; // most collisions of a path
    float anisotropy; // mean cosine of the phase function
    float majorant;   // largest extinction of the medium, 1/mm
    vec3 key_towards; // unit direction to the light
    vec3 key_light;   // irradiance
    vec3 back_towards;
    vec3 back_light;
    float back_share; // probability with which the back light is chosen
    vec3 environment; // radiance
};
#include "ray.glsl"
#include "region_fade.glsl"
#include "random.glsl"
readonly buffer Medium { vec4 entry[]; } medium; // albedo and extinction, 1/mm, over the sample value
uniform texture3D majorants;
uniform texture2D sums;    // of light and collisions
uniform texture2D squares; // sums of squares of luminance
uniform writeonly image2D next_sums;
uniform writeonly image2D next_squares;

const float PI = 3.14159265358979;
// Steps and tentative collisions of a straight path, which media in their limits do not reach.
const int MOST_STEPS = 1 << 16;
// Below this transmittance Russian roulette decides whether a path to a light goes on.
const float LEAST_TRANSMITTANCE = 0.1;
// Collisions from which on Russian roulette decides whether a path goes on.
const int SURE_EVENTS = 4;

// The part of a ray inside the box and on the near side of every clip plane, as in `ray_of`; leave < enter is a miss.
vec2 span(vec3 from, vec3 direction) {
    vec3 d = mix(direction, vec3(1e-12), lessThan(abs(direction), vec3(1e-12)));
    vec3 a = (box_low - from) / d, b = (box_high - from) / d;
    vec3 near = min(a, b), far = max(a, b);
    float enter = max(max(near.x, near.y), max(near.z, 0.0)), leave = min(far.x, min(far.y, far.z));
    for (int i = 0; i < CLIPS; ++i) {
        vec4 plane = clip_at(i);
        float towards = dot(plane.xyz, direction), clearance = plane.w - dot(plane.xyz, from);
        if (abs(towards) < 1e-12) leave = clearance < 0.0 ? -1.0 : leave;
        else if (towards > 0.0) leave = min(leave, clearance / towards);
        else enter = max(enter, clearance / towards);
    }
    return vec2(enter, leave);
}

// Albedo and extinction at a place.
vec4 medium_at(vec3 p) {
    vec3 texel;
    if (!locate(p, texel)) return vec4(0.0);
    float e = windowed(raw_volume(texel)) * float(ENTRIES - 1);
    int n = min(int(e), ENTRIES - 2);
    vec4 found = mix(medium.entry[n], medium.entry[n + 1], e - float(n));
    return vec4(found.rgb, found.a * faded(p));
}

float majorant_of(ivec3 cell) {
    if (BRICKS == 0) return majorant;
    ivec3 last = textureSize(majorants, 0) - 1, nearest = clamp(cell, ivec3(0), last);
    return cell == nearest ? texelFetch(majorants, nearest, 0).x : majorant;
}

// Goes straight from a place, through bricks (Amanatides and Woo 1987), from one tentative collision to the next. `ends`: to the first real one,
// whose place and medium are returned; the result is 0 if there was one, 1 otherwise. Without, the result is an estimate of the transmittance.
float track(vec3 from, vec3 direction, bool ends, inout uvec4 stream, out vec3 p, out vec4 found) {
    p = from;
    found = vec4(0.0);
    vec2 limits = span(from, direction);
    float leave = limits.y - limits.x, at = 0.0, transmitted = 1.0;
    if (!(leave > 0.0)) return 1.0;
    vec3 origin = from + direction * limits.x;
    vec3 each = direction * brick_density;
    vec3 d = mix(each, vec3(1e-12), lessThan(abs(each), vec3(1e-12)));
    vec3 q = (origin - brick_low) * brick_density;
    ivec3 cell = ivec3(floor(q)), onward = ivec3(mix(vec3(-1.0), vec3(1.0), greaterThan(d, vec3(0.0))));
    vec3 next = (vec3(cell) + max(vec3(onward), vec3(0.0)) - q) / d, apart = abs(1.0 / d);
    float bound = majorant_of(cell);
    vec4 u = draw(stream);
    float depth = -log(1.0 - u.x);
    for (int n = 0; n < MOST_STEPS; ++n) {
        float end = BRICKS == 1 ? min(leave, min(next.x, min(next.y, next.z))) : leave;
        float through = bound * max(end - at, 0.0);
        if (through <= depth) {
            if (end >= leave) return transmitted;
            depth -= through;
            at = max(at, end);
            bool is_x = next.x <= next.y && next.x <= next.z, is_y = !is_x && next.y <= next.z;
            ivec3 axis = ivec3(is_x, is_y, !is_x && !is_y);
            cell += onward * axis;
            next += apart * vec3(axis);
            bound = majorant_of(cell);
        } else {
            at += depth / bound;
            p = origin + direction * at;
            vec4 here = medium_at(p);
            float real = min(here.a / bound, 1.0);
            if (ends) {
                if (u.y < real) {
                    found = here;
                    return 0.0;
                }
            } else {
                transmitted *= 1.0 - real;
                if (transmitted < LEAST_TRANSMITTANCE) {
                    if (u.y * LEAST_TRANSMITTANCE >= transmitted) return 0.0;
                    transmitted = LEAST_TRANSMITTANCE;
                }
            }
            u = draw(stream);
            depth = -log(1.0 - u.x);
        }
    }
    return 0.0;
}

// Henyey and Greenstein 1941: the density over solid angle of a change of direction with this cosine.
float phase(float cosine) {
    float g = anisotropy, base = max(1.0 + g * g - 2.0 * g * cosine, 1e-6);
    return (1.0 - g * g) / (4.0 * PI * base * sqrt(base));
}

// A direction with that density.
vec3 scattered(vec3 along, vec2 u) {
    float g = anisotropy, cosine = 1.0 - 2.0 * u.x;
    if (abs(g) > 1e-3) {
        float ratio = (1.0 - g * g) / (1.0 - g + 2.0 * g * u.x);
        cosine = clamp((1.0 + g * g - ratio * ratio) / (2.0 * g), -1.0, 1.0);
    }
    float sine = sqrt(max(1.0 - cosine * cosine, 0.0)), turn = 2.0 * PI * u.y;
    // An orthonormal basis without a singularity (Duff et al. 2017).
    float side = along.z >= 0.0 ? 1.0 : -1.0, a = -1.0 / (side + along.z), b = along.x * along.y * a;
    vec3 right = vec3(1.0 + side * along.x * along.x * a, side * b, -side * along.x);
    vec3 up = vec3(b, side + along.y * along.y * a, -along.y);
    return normalize(sine * (cos(turn) * right + sin(turn) * up) + cosine * along);
}

// The light of one path, and 1 if it collided.
vec4 path(ivec2 pixel, int index) {
    uvec4 stream = uvec4(uint(pixel.x) | uint(pixel.y) << 16, uint(index), uint(seed), 0u);
    vec2 at = vec2(pixel) + draw(stream).xy;
    vec3 place = origin + origin_dx * at.x + origin_dy * at.y;
    vec3 along = normalize(direction + direction_dx * at.x + direction_dy * at.y);
    vec3 light = vec3(0.0), throughput = vec3(1.0);
    float collided = 0.0;
    for (int event = 0; event < events; ++event) {
        vec3 p, unused;
        vec4 found, of_light;
        if (track(place, along, true, stream, p, found) > 0.0) {
            if (event > 0) light += throughput * environment;
            break;
        }
        collided = 1.0;
        throughput *= found.rgb;
        if (max(throughput.x, max(throughput.y, throughput.z)) <= 0.0) break;
        vec4 u = draw(stream);
        bool is_back = u.x < back_share;
        vec3 towards = is_back ? back_towards : key_towards, arriving = is_back ? back_light : key_light;
        if (max(arriving.x, max(arriving.y, arriving.z)) > 0.0) {
            float transmitted = track(p, towards, false, stream, unused, of_light);
            float weight = phase(dot(along, towards)) * transmitted / (is_back ? back_share : 1.0 - back_share);
            light += throughput * weight * arriving;
        }
        if (event >= SURE_EVENTS) {
            float stays = min(max(throughput.x, max(throughput.y, throughput.z)), 1.0);
            if (u.y >= stays) break;
            throughput /= stays;
        }
        place = p;
        along = scattered(along, u.zw);
    }
    return vec4(light, collided);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(next_sums)))) return;
    vec4 sum = texelFetch(sums, pixel, 0);
    float square = texelFetch(squares, pixel, 0).x;
    // One path after the other, so that the sums are the same however many a dispatch adds.
    for (int n = 0; n < samples; ++n) {
        vec4 light = path(pixel, first_sample + n);
        sum += light;
        float luminance = dot(light.rgb, vec3(0.2126, 0.7152, 0.0722));
        square += luminance * luminance;
    }
    imageStore(next_sums, pixel, sum);
    imageStore(next_squares, pixel, vec4(square, 0.0, 0.0, 0.0));
}
