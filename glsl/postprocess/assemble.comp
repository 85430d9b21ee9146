// The picture from the rendering: the mean of several rays per pixel; or what is near and what is far at an edge of a surface, by the share of the pixel
// that each covers; or interpolation between the rays where one ray makes several pixels, without mixing what is near with what lies far behind it; in a
// 4-up picture, the rendering next to the planes; in a pair, the composited
// volume next to the lit surface.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int RAYS = 1; // along each edge of a pixel
layout(constant_id = 1) const int APART = 1; // pixels between two rays along each axis
layout(constant_id = 2) const int LAYOUT = 0;
const int FOUR = 1, PAIR = 2; // 0 the rendering alone
layout(constant_id = 4) const int REFINED = 0; // 1: only marked pixels have several rays
layout(constant_id = 3) const int GUIDED = 0; // 1: edges are where distances differ
layout(scalar) uniform Params {
    float cliff; // distances that differ by more belong to different things, mm
};
uniform texture2D rendered;
uniform texture2D planes;     // of a 4-up picture
uniform texture2D composited; // of a pair
uniform texture2D marks;      // of REFINED: 1 in pixels that have several rays
uniform texture2D single;     // of REFINED: the colour of one ray through the middle of each pixel
uniform texture2D guide;      // of GUIDED: the distance that each ray goes, MISS where it hits nothing
uniform writeonly image2D picture;

bool is_volume = false;
vec4 ray_at(ivec2 at) {
    if (LAYOUT == PAIR && is_volume) return texelFetch(composited, at, 0);
    return texelFetch(rendered, at, 0);
}

float sum_of(vec4 v) { return v.x + v.y + v.z + v.w; }

// The colour between four rays around a pixel. Where their distances differ by a cliff, the near colours and the far ones stay apart, along an edge
// that is smooth: where a mean over more rays, weighted by (1 - x^2)^2 along each axis, says that as many are near as far.
vec4 between(ivec2 at) {
    ivec2 last = textureSize(rendered, 0) - 1;
    vec2 place = clamp((vec2(at) + 0.5) / float(APART) - 0.5, vec2(0.0), vec2(last));
    ivec2 low = ivec2(place), high = min(low + 1, last);
    vec2 share = place - vec2(low);
    ivec2 across = ivec2(high.x, low.y), down = ivec2(low.x, high.y);
    vec4 a = ray_at(low), b = ray_at(across), c = ray_at(down), d = ray_at(high);
    vec4 weights = vec4((1.0 - share.x) * (1.0 - share.y), share.x * (1.0 - share.y), (1.0 - share.x) * share.y, share.x * share.y);
    vec4 plain = weights.x * a + weights.y * b + weights.z * c + weights.w * d;
    if (GUIDED == 0 || is_volume) return plain;

    vec4 distances = vec4(texelFetch(guide, low, 0).x, texelFetch(guide, across, 0).x, texelFetch(guide, down, 0).x, texelFetch(guide, high, 0).x);
    // Sorted, and cut at the widest gap.
    vec2 lesser = min(distances.xz, distances.yw), greater = max(distances.xz, distances.yw);
    float first = min(lesser.x, lesser.y), fourth = max(greater.x, greater.y);
    float mid = max(lesser.x, lesser.y), other = min(greater.x, greater.y);
    float second = min(mid, other), third = max(mid, other);
    float gap = second - first, limit = 0.5 * first + 0.5 * second;
    if (third - second > gap) {
        gap = third - second;
        limit = 0.5 * second + 0.5 * third;
    }
    if (fourth - third > gap) {
        gap = fourth - third;
        limit = 0.5 * third + 0.5 * fourth;
    }
    bool is_edge = gap > cliff;
    // Around an outline, what is near is all that is hit. Between two surfaces only the nearest rays tell: further away both may have the distance of
    // the other.
    int reach = is_hit(fourth) ? 2 : 4;
    int count = is_edge ? 4 * reach * reach : 0;
    float sum = 0.0;
    vec2 slope = vec2(0.0);
    for (int n = 0; n < count; ++n) {
        ivec2 offset = ivec2(n % (2 * reach), n / (2 * reach)) - reach + 1;
        float side = texelFetch(guide, clamp(low + offset, ivec2(0), last), 0).x < limit ? 0.5 : -0.5;
        vec2 x = (vec2(offset) - share) / float(reach);
        vec2 w = max(1.0 - x * x, vec2(0.0));
        sum += side * w.x * w.x * w.y * w.y;
        slope += side * w.x * w.y * x * w.yx;
    }
    if (!is_edge) return plain;
    vec4 is_near = vec4(lessThan(distances, vec4(limit)));
    // How far the pixel is on the near side of the edge, rays, and where the four rays are by the same straight edge. Where one of them is on the wrong
    // side by more than half a ray, in what is thinner than the mean's reach or has a corner, the four decide.
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
    return mix(far, near, clamp(0.5 + inside * float(APART), 0.0, 1.0));
}

#include "edge_coverage.glsl"

// The colour of a pixel with one ray, at an edge mixed with the colours beyond it. A step of half a cliff is no edge, one of a cliff is.
vec4 antialiased(ivec2 at) {
    vec4 own = ray_at(at);
    ivec2 last = textureSize(guide, 0) - 1;
    float here = texelFetch(guide, at, 0).x, jump = 0.0, limit = here;
    for (int n = 0; n < 4; ++n) {
        ivec2 offset = n < 2 ? ivec2(2 * n - 1, 0) : ivec2(0, 2 * n - 5);
        float there = texelFetch(guide, clamp(at + offset, ivec2(0), last), 0).x;
        if (abs(there - here) > jump) {
            jump = abs(there - here);
            limit = 0.5 * here + 0.5 * there;
        }
    }
    if (jump <= 0.5 * cliff) return own;
    bool is_outline = jump > 0.5 * MISS, is_own_near = here < limit;
    vec4 beyond = vec4(0.0);
    float sum = 0.0;
    for (int n = 0; n < 9; ++n) {
        ivec2 offset = ivec2(n % 3, n / 3) - 1, there = clamp(at + offset, ivec2(0), last);
        if (is_near(there, limit) == is_own_near) continue;
        float weight = offset.x == 0 || offset.y == 0 ? 2.0 : 1.0;
        beyond += weight * ray_at(there);
        sum += weight;
    }
    float near = near_share(at, is_outline ? 3 : 1, limit);
    float share = (is_own_near ? 1.0 - near : near) * clamp(2.0 * (jump / cliff) - 1.0, 0.0, 1.0);
    return mix(own, beyond / sum, share);
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    ivec2 size = imageSize(picture);
    if (any(greaterThanEqual(pixel, size))) return;
    ivec2 at = pixel;
    if (LAYOUT == FOUR) {
        // The rendering is the lower right tile.
        at = pixel - size / 2;
        if (any(lessThan(at, ivec2(0)))) {
            imageStore(picture, pixel, texelFetch(planes, pixel, 0));
            return;
        }
    }
    if (LAYOUT == PAIR) {
        // The volume is the left half.
        is_volume = pixel.x < size.x / 2;
        if (!is_volume) at.x -= size.x / 2;
    }
    // Colours are already multiplied by their opacity.
    if (APART > 1) {
        imageStore(picture, pixel, between(at));
        return;
    }
    if (GUIDED == 1 && !is_volume) {
        imageStore(picture, pixel, antialiased(at));
        return;
    }
    if (REFINED == 1 && texelFetch(marks, at, 0).x == 0.0) {
        imageStore(picture, pixel, texelFetch(single, at, 0));
        return;
    }
    vec4 sum = vec4(0.0);
    for (int i = 0; i < RAYS * RAYS; ++i) sum += ray_at(at * RAYS + ivec2(i % RAYS, i / RAYS));
    imageStore(picture, pixel, sum / float(RAYS * RAYS));
}
