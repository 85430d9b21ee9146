// VR with an error that every pixel states. Light is integrated between every two samples of a ray, and between every second, beginning with the first and with the
// next. The larger difference on the screen is the error that is stated. A ray whose error is too large is cast again with shorter steps.
// variants: first; refine REFINE
#version 460
#include "common.glsl"
#include "tone_constants.glsl"
layout(scalar) uniform Params {
#include "ray_params.glsl"
#include "compositing_params.glsl"
#include "tone_params.glsl"
    float allowed;   // error of a pixel, 0..1 of the screen
    float brightest; // light of matter, at most
    int finest;      // times that a step may be halved
    int columns;     // of the picture
    int rows;
};
// The steps of a ray are its own, and what they absorb follows. With REFINE the rays are those of the listed pixels; without, they form a lattice, one through
// every other pixel of every other row.
float longest_step = step_length;
float own_step = longest_step;
float absorption_per_mm = absorption_scale / longest_step;
#define step_length own_step
#include "ray.glsl"
#include "empty_space.glsl"
#include "compositing.glsl"
#include "cap.glsl"
#include "tone.glsl"
#if defined(REFINE)
uniform utexture2D error_marks;   // of each tile of 8 x 8 pixels, a bit for each pixel that is listed
uniform utexture2D marked_before; // in the tiles before
uniform utexture2D refine_groups; // x, y, z of the dispatch; the length of the list
uniform writeonly image2D picture;
uniform writeonly image2D errors; // 0..1 of the screen; 0 where nothing along the ray can be seen, which is certain
#else
uniform writeonly image2D lattice;
uniform writeonly image2D lattice_errors; // the colour on the screen; its error
#endif
readonly buffer TransferIntegral { vec4 entry[]; } transfer_integral; // of absorption times colour, and of absorption, up to each entry

// The error that is stated where matter was met and none was found.
const float LEAST = 1e-6;
// Values that differ by less are one: their mean is that of both, and the difference of the integrals is rounding.
const float SAME_VALUE = 1e-3;

vec3 shown(vec4 rgba) { return rgba.a > 0.0 ? toned(rgba.rgb) : vec3(0.0); }
float largest(vec3 c) { return max(c.x, max(c.y, c.z)); }

// A sample of a ray.
struct At {
    float offset; // mm behind the entry
    bool inside;
    float value;
    vec4 integral; // of absorption times colour, and of absorption, over the values up to this one
    vec4 entry;    // colour and absorption of this value
    vec4 place;    // coordinates in the sector
};

// Between two entries both are linear in the value.
vec4 integral_to(float value, out vec4 there) {
    float e = value * float(ENTRIES - 1);
    int n = min(int(e), ENTRIES - 2);
    float t = e - float(n), width = 1.0 / float(ENTRIES - 1);
    vec4 low = transfer.entry[n], rise = transfer.entry[n + 1] - low;
    there = low + t * rise;
    vec3 colour = t * (low.a * low.rgb + 0.5 * t * (low.a * rise.rgb + rise.a * low.rgb) + t * t / 3.0 * rise.a * rise.rgb);
    return transfer_integral.entry[n] + width * vec4(colour, t * (low.a + 0.5 * t * rise.a));
}

At sample_at(Ray ray, float offset) {
    At at;
    at.offset = offset;
    at.value = 0.0;
    at.integral = vec4(0.0);
    at.entry = vec4(0.0);
    vec3 texel;
    at.inside = locate(place_at(ray, offset), texel, at.place);
    if (at.inside) {
        at.value = sample_volume(texel);
        at.integral = integral_to(at.value, at.entry);
    }
    return at;
}

// What the matter between two samples adds, as if the value went evenly from one to the other: mean colour and absorption; its optical depth.
float depth_between(Ray ray, At a, At b, out vec4 entry) {
    entry = vec4(0.0);
    if (!a.inside && !b.inside) return 0.0;
    float length = b.offset - a.offset;
    vec3 p = place_at(ray, 0.5 * (a.offset + b.offset));
    // A step over the sector's border is as long as its part inside, and has the value of the end inside.
    if (SWEEP > 0 && a.inside != b.inside) length *= a.inside ? share_inside(a.place, b.place) : share_inside(b.place, a.place);
    float rise = a.inside && b.inside ? b.value - a.value : 0.0;
    bool is_same = abs(rise) < SAME_VALUE;
    vec4 mean = (b.integral - a.integral) / (is_same ? 1.0 : rise);
    vec4 even = 0.5 * ((a.inside ? a.entry : b.entry) + (b.inside ? b.entry : a.entry));
    entry = is_same ? even : vec4(mean.rgb / max(mean.a, 1e-20), mean.a);
    return entry.a * faded(p) * absorption_per_mm * length;
}

// How much of the colours' difference at both ends the shade of a step on itself may take from its mean: of even matter y / 12 of a thin step, a half of an
// opaque one; more where absorption rises.
float self_shade(float depth) { return depth / (depth + 12.0); }

void add_between(Ray ray, At a, At b, vec4 entry, float added, inout vec4 sum) {
    vec3 colour = sum.rgb;
    float opacity = sum.a;
    add_step(entry, added, place_at(ray, 0.5 * (a.offset + b.offset)), colour, opacity);
    sum = vec4(colour, opacity);
}

// The same with the light of its own middle.
void catch_up(Ray ray, At a, At b, inout vec4 sum) {
    vec4 entry;
    float added = opacity_of(depth_between(ray, a, b, entry));
    if (added <= 0.0) return;
    if (LIT == 1) look_up_light(place_at(ray, 0.5 * (a.offset + b.offset)), ray.direction);
    add_between(ray, a, b, entry, added, sum);
}

// A ray: premultiplied colour and opacity by its steps, and by steps of twice the length that begin at every other sample, and at those between. `meets`: it
// goes through a brick that is not empty. `ended`: it was left before its end.
// `doubt`: what the shade of steps on themselves may change.
void march(Ray ray, out vec4 fine, out vec4 here, out vec4 behind, out vec3 doubt, out bool meets, out bool ended) {
    // The long steps of `here` end at the last sample, those of `behind` at the one before.
    fine = here = behind = vec4(0.0);
    doubt = vec3(0.0);
    meets = ended = false;
    lit_steps = -2;
    float path = ray.leave - ray.enter;
    if (path <= 0.0) return;
    int complete = int(steps_to(ray, path)) + SPREAD;
    At last, before;
    bool known = false; // the sample that step i begins with
    for (int i = 0; i <= complete && !ended;) {
        int stop = complete + 1;
        if (SKIP == 1) {
            // A step is empty if the samples at both of its ends are: the last sample of a segment ends the last empty step.
            int to = i;
            RaySegment segment = segment_at(ray, to, 0.0);
            while (segment.kind == EMPTY && segment.stop - 1 > to && segment.stop - 1 <= complete) {
                to = segment.stop - 1;
                segment = segment_at(ray, to, 0.0);
            }
            bool is_over = segment.kind == EMPTY && segment.stop - 1 > complete;
            if (known && (to > i || is_over)) {
                catch_up(ray, before, last, behind);
                known = false;
            }
            if (is_over) break;
            i = to;
            stop = min(stop, i + SAMPLES_PER_LOOKUP);
        }
        meets = true;
        if (!known) {
            last = sample_at(ray, offset_of(ray, float(i)));
            before = last;
            known = true;
        }
        for (; i < stop && !ended; ++i) {
            float offset = min(offset_of(ray, float(i + 1)), path);
            if (offset <= last.offset) continue;
            At next = sample_at(ray, offset);
            vec4 entry, long_entry;
            float depth = depth_between(ray, last, next, entry);
            float added = opacity_of(depth), long_added = opacity_of(depth_between(ray, before, next, long_entry));
            vec3 unsure = last.inside && next.inside ? (1.0 - fine.a) * added * self_shade(depth) * abs(next.entry.rgb - last.entry.rgb) : vec3(0.0);
            if (LIT == 1) {
                // The light in the middle of a long step is the mean of those in its halves.
                vec3 scattered_before = scattered;
                float highlight_before = highlight;
                bool is_first = lit_steps != i - 1;
                if (max(added, long_added) > 0.0) {
                    look_up_light(place_at(ray, 0.5 * (last.offset + offset)), ray.direction);
                    lit_steps = i;
                }
                unsure *= scattered;
                add_between(ray, last, next, entry, added, fine);
                vec3 scattered_here = scattered;
                float highlight_here = highlight;
                scattered = is_first ? scattered : 0.5 * (scattered + scattered_before);
                highlight = is_first ? highlight : 0.5 * (highlight + highlight_before);
                add_between(ray, before, next, long_entry, long_added, behind);
                scattered = scattered_here;
                highlight = highlight_here;
            } else {
                add_between(ray, last, next, entry, added, fine);
                add_between(ray, before, next, long_entry, long_added, behind);
            }
            doubt += unsure;
            vec4 reached = behind;
            behind = here;
            here = reached;
            before = last;
            last = next;
            ended = EARLY_END == 1 && min(fine.a, min(here.a, behind.a)) >= opaque_enough;
        }
    }
    if (known && !ended) catch_up(ray, before, last, behind);
}

// The colour of a pixel with steps halved so many times, and its error.
vec4 cast_ray(ivec2 pixel, vec2 cut, int halvings, out float error) {
    own_step = ldexp(longest_step, -halvings);
    int face;
    Ray ray = ray_through(vec2(pixel) + 0.5, face);
    if (ends_ray(cut)) ray.leave = -1.0;
    vec4 fine, even, odd;
    vec3 doubt;
    bool meets, ended;
    march(ray, fine, even, odd, doubt, meets, ended);
    ivec2 size = ivec2(columns, rows);
    vec4 rgba = capped(cut, developed(fine.rgb, fine.a, pixel, size));
    error = 0.0;
    if (meets) {
        vec3 colour = shown(rgba);
        vec3 off = abs(shown(capped(cut, developed(even.rgb, even.a, pixel, size))) - colour);
        off = max(off, abs(shown(capped(cut, developed(odd.rgb, odd.a, pixel, size))) - colour));
        off += abs(shown(capped(cut, developed(fine.rgb + doubt, fine.a, pixel, size))) - colour);
        if (ended) {
            // Behind the place where the ray was left there may be anything.
            float left = 1.0 - fine.a;
            vec4 most = vec4(fine.rgb + left * brightest, 1.0);
            off += abs(shown(capped(cut, developed(most.rgb, most.a, pixel, size))) - colour);
        }
        error = max(largest(off), LEAST);
    }
    return rgba;
}

// The colour of a pixel with steps as short as its error needs. Of second order, each halving leaves a quarter; where it leaves more, the next one follows.
vec4 settled(ivec2 pixel, int halvings, out float error) {
    vec2 cut = cap_at(pixel);
    vec4 rgba;
    bool again;
    do {
        rgba = cast_ray(pixel, cut, halvings, error);
        again = error > allowed && halvings < finest;
        if (again) halvings = min(halvings + max(int(ceil(0.5 * log2(error / allowed))), 1), finest);
    } while (again);
    return rgba;
}

#if defined(REFINE)
// The pixel at a place of the list.
ivec2 listed(int index) {
    ivec2 tiles = (ivec2(columns, rows) + 7) / 8;
    int low = 0, high = tiles.x * tiles.y;
    // The last tile with no more than so many before it.
    while (high - low > 1) {
        int half_way = (low + high) / 2;
        bool is_behind = int(texelFetch(marked_before, ivec2(half_way % tiles.x, half_way / tiles.x), 0).x) > index;
        low = is_behind ? low : half_way;
        high = is_behind ? half_way : high;
    }
    ivec2 tile = ivec2(low % tiles.x, low / tiles.x);
    uvec2 marks = texelFetch(error_marks, tile, 0).xy;
    int before = index - int(texelFetch(marked_before, tile, 0).x), in_first = bitCount(marks.x);
    uint bits = before < in_first ? marks.x : marks.y;
    int skipped = before < in_first ? before : before - in_first;
    for (int n = 0; n < skipped; ++n) bits &= bits - 1u;
    int bit = findLSB(bits) + (before < in_first ? 0 : 32);
    return 8 * tile + ivec2(bit & 7, bit >> 3);
}

void main() {
    int index = int((gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationIndex);
    if (index >= int(texelFetch(refine_groups, ivec2(3, 0), 0).x)) return;
    ivec2 pixel = listed(index);
    float error;
    // What is there is thinner than the distance of the lattice's rays: it may be thinner than their steps.
    vec4 rgba = settled(pixel, 1, error);
    imageStore(picture, pixel, rgba);
    imageStore(errors, pixel, vec4(error, 0.0, 0.0, 0.0));
}
#else
void main() {
    ivec2 at = ray_pixel();
    if (any(greaterThanEqual(2 * at, ivec2(columns, rows)))) return;
    float error;
    vec4 rgba = settled(2 * at, 0, error);
    imageStore(lattice, at, rgba);
    imageStore(lattice_errors, at, vec4(shown(rgba), error));
}
#endif
