// The picture from the rendering: the mean of several rays per pixel; or what is near and what is far at an edge of a surface, by the share of the pixel
// that each covers; or interpolation between the rays where one ray makes several pixels, without mixing what is near with what lies far behind it; the
// rendering next to planes; in a pair, the composited volume next to the lit surface.
// TONED: writes the final 8 bits directly, where stage 4 only tones what was assembled.
// variants: plain; toned TONED
#version 460
#include "common.glsl"
layout(constant_id = 0) const int RAYS = 1; // along each edge of a pixel
layout(constant_id = 1) const int APART = 1; // pixels between two rays along each axis
layout(constant_id = 2) const int LAYOUT = 0;
const int FOUR = 1, PAIR = 2, BESIDE = 3; // 0 the rendering alone
layout(constant_id = 4) const int REFINED = 0; // 1: only marked pixels have several rays
layout(constant_id = 3) const int GUIDED = 0; // 1: edges are where distances differ
#ifdef TONED
#include "tone_constants.glsl"
layout(constant_id = 33) const int LINES = 0; // not 0: over planes
#endif
layout(scalar) uniform Params {
    float cliff; // distances that differ by more belong to different things, mm
#ifdef TONED
#include "tone_params.glsl"
    int columns; // of planes
    int rows;
    float line_strength; // 0..1
#endif
};
uniform texture2D rendered;
uniform texture2D planes;     // of FOUR: as large as the picture; of BESIDE: its right or lower part
uniform texture2D composited; // of a pair
uniform texture2D marks;      // of REFINED: 1 in pixels that have several rays
uniform texture2D single;     // of REFINED: the colour of one ray through the middle of each pixel
uniform texture2D guide;      // of GUIDED: the distance that each ray goes, MISS where it hits nothing
#include "cap.glsl"
#ifdef TONED
uniform writeonly image2D screen;
#define TARGET screen
#include "tiles.glsl"
#include "tone.glsl"
#include "cross_lines.glsl"
#else
uniform writeonly image2D picture;
#define TARGET picture
#endif

const bool HAS_PLANES = LAYOUT == FOUR || LAYOUT == BESIDE;
// The first column and row of planes, and the first ones of the rendering and those after it.
ivec2 tiles_first(ivec2 size) { return LAYOUT == BESIDE ? size - textureSize(planes, 0) : ivec2(0); }
ivec2 rendering_first(ivec2 size) { return LAYOUT == FOUR ? size / 2 : ivec2(0); }
ivec2 rendering_end(ivec2 size) {
    if (LAYOUT != BESIDE) return size;
    ivec2 tiles = tiles_first(size);
    return ivec2(tiles.x > 0 ? tiles.x : size.x, tiles.y > 0 ? tiles.y : size.y);
}

void store(ivec2 pixel, vec4 colour) {
#ifdef TONED
    // Pixels without a hit stay black, whatever the brightness.
    vec3 c = colour.a > 0.0 ? toned(colour.rgb) : vec3(0.0);
    ivec2 size = imageSize(TARGET), first = tiles_first(size);
    if (LINES != 0 && all(greaterThanEqual(pixel, first))) c = with_lines(c, pixel - first, size - first);
    colour = vec4(c, 1.0);
#endif
    imageStore(TARGET, pixel, colour);
}

bool is_volume = false; // of PAIR: the pixel shows the composited volume
// The distance that tells edges. A cut face is nearer than all else: it has an edge where it meets the surface that it cuts, too.
bool has_edges() { return CAPPED == 1 || (GUIDED == 1 && !is_volume); }
float guide_at(ivec2 at) {
    if (is_capped(cap_at(at))) return 0.0;
    return GUIDED == 1 && !is_volume ? texelFetch(guide, at, 0).x : MISS;
}

vec4 ray_at(ivec2 at) {
    if (LAYOUT == PAIR && is_volume) return texelFetch(composited, at, 0);
    return texelFetch(rendered, at, 0);
}

float sum_of(vec4 v) { return v.x + v.y + v.z + v.w; }

// The pixels of one column between the same four rays. Where the distances of the rays differ by a cliff, the near colours and the far ones stay apart, along an
// edge that is smooth: where a mean over more rays, weighted by (1 - x^2)^2 along each axis, says that as many are near as far. What depends on the rays
// alone is found once for all of the pixels.
void enlarge(ivec2 cell, ivec2 size) {
    ivec2 corner = rendering_first(size), end = rendering_end(size), tiles = tiles_first(size);
    if (LAYOUT == PAIR) {
        // The volume is the left half.
        is_volume = cell.x < size.x / 2;
        corner.x = is_volume ? 0 : size.x / 2;
    }
    // Rays go through the middle of APART pixels: between two of them are as many, half of them before the first one.
    int lead = (APART / 2 + APART - corner.y % APART) % APART, top = cell.y * APART - lead;
    ivec2 last = textureSize(rendered, 0) - 1;
    float across = clamp((float(cell.x - corner.x) + 0.5) / float(APART) - 0.5, 0.0, float(last.x));
    float first_place = (float(top - corner.y) + 0.5) / float(APART) - 0.5;
    ivec2 low = ivec2(int(across), int(clamp(first_place, 0.0, float(last.y)))), high = min(low + 1, last);
    vec2 share = vec2(across - float(low.x), 0.0);
    ivec2 right = ivec2(high.x, low.y), below = ivec2(low.x, high.y);
    vec4 a = ray_at(low), b = ray_at(right), c = ray_at(below), d = ray_at(high);
    vec4 upper = (1.0 - share.x) * a + share.x * b, lower = (1.0 - share.x) * c + share.x * d;

    bool is_edge = false;
    vec4 distances = vec4(0.0);
    float limit = 0.0;
    int reach = 2;
    if (has_edges()) {
        distances = vec4(guide_at(low), guide_at(right), guide_at(below), guide_at(high));
        // Sorted, and cut at the widest gap.
        vec2 lesser = min(distances.xz, distances.yw), greater = max(distances.xz, distances.yw);
        float first = min(lesser.x, lesser.y), fourth = max(greater.x, greater.y);
        float mid = max(lesser.x, lesser.y), other = min(greater.x, greater.y);
        float second = min(mid, other), third = max(mid, other);
        float gap = second - first;
        limit = 0.5 * first + 0.5 * second;
        if (third - second > gap) {
            gap = third - second;
            limit = 0.5 * second + 0.5 * third;
        }
        if (fourth - third > gap) {
            gap = fourth - third;
            limit = 0.5 * third + 0.5 * fourth;
        }
        is_edge = gap > cliff && cell.x >= corner.x && cell.x < end.x;
        // Around an outline or a cut face, what is near is all that is hit or cut. Between two surfaces only the nearest rays tell: further away both may
        // have the distance of the other.
        reach = is_hit(fourth) && first > 0.0 ? 2 : 4;
    }
    for (int n = 0; n < APART; ++n) {
        int y = top + n;
        float along = clamp(first_place + float(n) / float(APART), 0.0, float(last.y)) - float(low.y);
        vec4 colour = (1.0 - along) * upper + along * lower;
        ivec2 at = ivec2(cell.x, y);
        bool is_plane = HAS_PLANES && (any(lessThan(at, corner)) || any(greaterThanEqual(at, end)));
        if (is_plane) colour = texelFetch(planes, clamp(at - tiles, ivec2(0), size - tiles - 1), 0);
        if ((is_plane || !is_edge) && y >= 0 && y < size.y) store(ivec2(cell.x, y), colour);
    }
    if (GUIDED == 0 && CAPPED == 0) return;

    // Which rays around are near: a byte for each row.
    uvec2 near_rays = uvec2(0u);
    int side = 2 * reach;
    for (int n = 0; n < (is_edge ? side * side : 0); ++n) {
        ivec2 at = ivec2(n & side - 1, n >> (reach == 2 ? 2 : 3));
        bool is_near = guide_at(clamp(low + at - reach + 1, ivec2(0), last)) < limit;
        uint bit = is_near ? 1u << (8 * (at.y & 3) + at.x) : 0u;
        near_rays |= at.y < 4 ? uvec2(bit, 0u) : uvec2(0u, bit);
    }
    vec4 is_near = vec4(lessThan(distances, vec4(limit)));
    for (int n = 0; n < (is_edge ? APART : 0); ++n) {
        share.y = clamp(first_place + float(n) / float(APART), 0.0, float(last.y)) - float(low.y);
        float sum = 0.0;
        vec2 slope = vec2(0.0);
        for (int row = 0; row < side; ++row) {
            uint rays = (row < 4 ? near_rays.x : near_rays.y) >> (8 * (row & 3));
            float rows = 0.0, rise = 0.0;
            // Beyond the reach the weight is 0.
            for (int i = 0; i < 8; ++i) {
                float x = (float(i - reach + 1) - share.x) / float(reach), w = max(1.0 - x * x, 0.0);
                float weight = (rays >> i & 1u) != 0u ? 0.5 * w : -0.5 * w;
                rows += weight * w;
                rise += weight * x;
            }
            float y = (float(row - reach + 1) - share.y) / float(reach), w = max(1.0 - y * y, 0.0);
            sum += rows * w * w;
            slope += vec2(rise * w, rows * y) * w;
        }
        vec4 weights = vec4((1.0 - share.x) * (1.0 - share.y), share.x * (1.0 - share.y), (1.0 - share.x) * share.y, share.x * share.y);
        // How far the pixel is on the near side of the edge, rays, and where the four rays are by the same straight edge. Where one of them is on the
        // wrong side by more than half a ray, in what is thinner than the mean's reach or has a corner, the four decide.
        float steep = length(slope);
        float inside = sum / max(4.0 / float(reach) * steep, 1e-6);
        vec2 inwards = slope / max(steep, 1e-6);
        vec4 insides = inside + inwards.x * (vec4(0.0, 1.0, 0.0, 1.0) - share.x) + inwards.y * (vec4(0.0, 0.0, 1.0, 1.0) - share.y);
        vec4 wrong = insides * (1.0 - 2.0 * is_near);
        if (max(max(wrong.x, wrong.y), max(wrong.z, wrong.w)) > 0.5) inside = sum_of(weights * is_near) - 0.5;
        // A ray that the pixel lies on has a side, but no weight for the other.
        vec4 nears = (weights + 1e-3) * is_near, fars = (weights + 1e-3) * (1.0 - is_near);
        vec4 near = (nears.x * a + nears.y * b + nears.z * c + nears.w * d) / sum_of(nears);
        vec4 far = (fars.x * a + fars.y * b + fars.z * c + fars.w * d) / sum_of(fars);
        vec4 colour = mix(far, near, clamp(0.5 + inside * float(APART), 0.0, 1.0));
        int y = top + n;
        if (is_edge && y >= corner.y && y < end.y) store(ivec2(cell.x, y), colour);
    }
}

#include "edge_coverage.glsl"

// The colour of a pixel with one ray, at an edge mixed with the colours beyond it. A step of half a cliff is no edge, one of a cliff is.
vec4 antialiased(ivec2 at) {
    vec4 own = ray_at(at);
    ivec2 last = textureSize(rendered, 0) - 1;
    float here = guide_at(at), jump = 0.0, limit = here;
    for (int n = 0; n < 4; ++n) {
        ivec2 offset = n < 2 ? ivec2(2 * n - 1, 0) : ivec2(0, 2 * n - 5);
        float there = edge_distance(at + offset);
        if (abs(there - here) > jump) {
            jump = abs(there - here);
            limit = 0.5 * here + 0.5 * there;
        }
    }
    if (jump <= 0.5 * cliff) return own;
    bool is_own_near = here < limit;
    // The nearer of the two is a cut face, or the further one is nothing.
    bool is_outline = limit <= 0.5 * jump || jump > 0.5 * MISS;
    vec4 beyond = vec4(0.0);
    float sum = 0.0;
    for (int n = 0; n < 9; ++n) {
        ivec2 offset = ivec2(n % 3, n / 3) - 1, there = clamp(at + offset, ivec2(0), last);
        if ((guide_at(there) < limit) == is_own_near) continue;
        float weight = offset.x == 0 || offset.y == 0 ? 2.0 : 1.0;
        beyond += weight * ray_at(there);
        sum += weight;
    }
    float near = near_share(at, is_outline, limit);
    float share = (is_own_near ? 1.0 - near : near) * clamp(2.0 * (jump / cliff) - 1.0, 0.0, 1.0);
    return mix(own, beyond / sum, share);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(TARGET);
    if (APART > 1) {
        if (pixel.x < size.x) enlarge(pixel, size);
        return;
    }
    if (any(greaterThanEqual(pixel, size))) return;
    ivec2 at = pixel;
    if (HAS_PLANES) {
        at = pixel - rendering_first(size);
        if (any(lessThan(at, ivec2(0))) || any(greaterThanEqual(pixel, rendering_end(size)))) {
            store(pixel, texelFetch(planes, pixel - tiles_first(size), 0));
            return;
        }
    }
    if (LAYOUT == PAIR) {
        // The volume is the left half.
        is_volume = pixel.x < size.x / 2;
        if (!is_volume) at.x -= size.x / 2;
    }
    // Colours are already multiplied by their opacity.
    if (RAYS == 1 && has_edges()) {
        store(pixel, antialiased(at));
        return;
    }
    if (REFINED == 1 && texelFetch(marks, at, 0).x == 0.0) {
        store(pixel, texelFetch(single, at, 0));
        return;
    }
    vec4 sum = vec4(0.0);
    for (int i = 0; i < RAYS * RAYS; ++i) sum += ray_at(at * RAYS + ivec2(i % RAYS, i / RAYS));
    store(pixel, sum / float(RAYS * RAYS));
}
