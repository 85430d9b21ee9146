// Labels over the finished picture: on planes the boundary of each label and a translucent fill, in a rendering a translucent shell.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int PLANES = 0;    // 1: the picture has planes
layout(constant_id = 1) const int RENDERING = 0; // 1: and a rendering, or it alone
layout(constant_id = 2) const int CURVED = 0;    // 1: the last tile is a curved plane
layout(constant_id = 3) const int GUIDED = 0;    // 1: a rendered surface dims what is behind it
layout(scalar) uniform Params {
#include "ray_block.glsl"
    // From space to the index of a voxel: dot(xyz, p) + w.
    vec4 index_x;
    vec4 index_y;
    vec4 index_z;
    // Corner and size of the parts of the picture, pixels.
    vec4 planes_area;
    vec4 rendering_area;
    int columns; // of planes
    int rows;
    float rays_per_pixel; // along an axis
    float outline; // opacity, as the others
    float fill;
    float shell;
    float behind;  // share of it behind a surface
    float voxel;   // the shortest edge of one, mm
};
uniform texture2D unlabelled;
uniform texture3D labels;      // number of the label / 255
uniform texture3D label_cover; // share of the surroundings that has a label: 0.5 at the surface
uniform texture2D guide;       // of GUIDED: distance of the surface on each ray
readonly buffer LabelColours { vec4 entry[]; } label_colours;
uniform writeonly image2D screen;
#include "tiles.glsl"
readonly buffer CurveColumns { vec4 entry[]; } curve_columns;

const float HALF_LINE = 0.75;  // of an outline, pixels
const float CASING = 0.5;      // opacity of the dark line on both sides of it, a pixel wide
const float AMBIENT = 0.35;    // light on the shell where the ray grazes it
const int BISECTIONS = 6;

vec3 index_of(vec3 p) { return vec3(dot(index_x.xyz, p) + index_x.w, dot(index_y.xyz, p) + index_y.w, dot(index_z.xyz, p) + index_z.w); }
vec3 index_along(vec3 v) { return vec3(dot(index_x.xyz, v), dot(index_y.xyz, v), dot(index_z.xyz, v)); }

bool is_within(ivec3 at) { return all(greaterThanEqual(at, ivec3(0))) && all(lessThan(at, textureSize(labels, 0))); }
float cover_of(ivec3 at) { return is_within(at) ? texelFetch(label_cover, at, 0).x : 0.0; }

// 0 if none of the corners of the cell has a label, because the nearest one has no cover; otherwise 1. It counts the rounds of a loop: a CPU executes both
// sides of a branch, but leaves a loop that no invocation needs.
int is_near(vec3 q) { return cover_of(ivec3(floor(q + 0.5))) == 0.0 ? 0 : 1; }

// Weight of a corner of the cell, and how it rises along each axis.
vec4 weight_of(int corner, vec3 share) {
    bvec3 upper = bvec3((corner & 1) != 0, (corner & 2) != 0, (corner & 4) != 0);
    vec3 w = mix(1.0 - share, share, upper), rise = mix(vec3(-1.0), vec3(1.0), upper);
    return vec4(w.x * w.y * w.z, rise.x * w.y * w.z, w.x * rise.y * w.z, w.x * w.y * rise.z);
}
ivec3 corner_of(int corner) { return ivec3(corner & 1, corner >> 1 & 1, corner >> 2); }

float cover_at(vec3 q) {
    ivec3 low = ivec3(floor(q));
    int rounds = is_near(q);
    float sum = 0.0;
    for (int once = 0; once < rounds; ++once) {
        for (int n = 0; n < 8; ++n) sum += weight_of(n, q - vec3(low)).x * cover_of(low + corner_of(n));
    }
    return sum;
}

// Cover and its slope by voxel; the label with the largest share of the corners, 0 for none; and how much larger that is than the share of another label, with
// its slope. Without another one the slope is 0.
int look(vec3 q, out vec4 cover, out vec4 lead) {
    ivec3 low = ivec3(floor(q));
    vec3 share = q - vec3(low);
    int ids[8];
    cover = vec4(0.0);
    for (int n = 0; n < 8; ++n) {
        ivec3 at = low + corner_of(n);
        bool is_in = is_within(at);
        ids[n] = is_in ? int(texelFetch(labels, at, 0).x * 255.0 + 0.5) : 0;
        cover += weight_of(n, share) * (is_in ? texelFetch(label_cover, at, 0).x : 0.0);
    }
    int first = 0, second = 0;
    vec4 most = vec4(0.0), next = vec4(0.0);
    for (int n = 0; n < 8; ++n) {
        int id = ids[n];
        if (id == 0 || id == first || id == second) continue;
        vec4 sum = vec4(0.0);
        for (int i = 0; i < 8; ++i) sum += ids[i] == id ? weight_of(i, share) : vec4(0.0);
        if (first == 0 || sum.x > most.x) {
            second = first;
            next = most;
            first = id;
            most = sum;
        } else if (second == 0 || sum.x > next.x) {
            second = id;
            next = sum;
        }
    }
    lead = second == 0 ? vec4(1.0, vec3(0.0)) : most - next;
    return first;
}

// Pixels to where a value is 0, by its slope.
float pixels_to(float value, vec3 slope, vec3 right, vec3 down) { return value / max(length(vec2(dot(slope, right), dot(slope, down))), 1e-6); }

// Colour times opacity, and opacity, at a place of a plane; `dx` and `dy`: a pixel to the right and down.
vec4 on_plane(vec3 p, vec3 dx, vec3 dy) {
    vec4 cover = vec4(0.0), lead = vec4(0.0);
    vec3 q = index_of(p);
    int label = 0, rounds = is_near(q);
    for (int once = 0; once < rounds; ++once) label = look(q, cover, lead);
    if (label == 0) return vec4(0.0);
    vec3 right = index_along(dx), down = index_along(dy);
    float inside = pixels_to(cover.x - 0.5, cover.yzw, right, down);
    float edge = abs(inside);
    if (inside > 0.0) edge = min(edge, pixels_to(lead.x, lead.yzw, right, down));
    vec3 colour = label_colours.entry[label].rgb;
    vec4 over = vec4(colour, 1.0) * (fill * clamp(0.5 + inside, 0.0, 1.0));
    over = mix(over, vec4(vec3(0.0), 1.0), outline * CASING * clamp(HALF_LINE + 1.5 - edge, 0.0, 1.0));
    return mix(over, vec4(colour, 1.0), outline * clamp(HALF_LINE + 0.5 - edge, 0.0, 1.0));
}

vec4 on_tile(ivec2 pixel, ivec2 size) {
    ivec2 cells = ivec2(columns, rows), cell = cell_of(pixel, size, cells);
    int n = cell.y * columns + cell.x;
    if (n >= tile_count()) return vec4(0.0);
    ivec2 first = cell_corner(cell, size, cells);
    vec2 at = vec2(pixel - first) + 0.5;
    vec3 corner = tile_corner(n), dx = tile_dx(n), dy = tile_dy(n);
    if (CURVED == 1 && n == tile_count() - 1) {
        int column = 2 * (pixel.x - first.x), last = curve_columns.entry.length() - 2;
        vec4 here = curve_columns.entry[column];
        vec4 before = curve_columns.entry[max(column - 2, 0)], after = curve_columns.entry[min(column + 2, last)];
        if (here.w == 0.0) return vec4(0.0);
        dx = after.w > 0.0 && column < last ? after.xyz - here.xyz : before.w > 0.0 ? here.xyz - before.xyz : vec3(0.0);
        return on_plane(here.xyz + dy * at.y, dx, dy);
    }
    return on_plane(corner + dx * at.x + dy * at.y, dx, dy);
}

// Colour times opacity, and opacity, of the shell: where the ray first gets to the surface of a label.
vec4 on_ray(vec2 ray) {
    vec3 from = origin + origin_dx * ray.x + origin_dy * ray.y;
    vec3 along = normalize(direction + direction_dx * ray.x + direction_dy * ray.y);
    vec3 q = index_of(from), pace = index_along(along);
    pace = mix(pace, vec3(1e-9), lessThan(abs(pace), vec3(1e-9)));
    vec3 low = (-1.0 - q) / pace, high = (vec3(textureSize(labels, 0)) - q) / pace;
    vec3 enters = min(low, high), leaves = max(low, high);
    float enter = max(max(max(enters.x, enters.y), enters.z), 0.0), leave = min(min(leaves.x, leaves.y), leaves.z);
    // A voxel along the axis that the ray follows most.
    float each = 1.0 / max(max(abs(pace.x), abs(pace.y)), abs(pace.z));
    int count = int(ceil((leave - enter) / each));
    float hit = -1.0;
    for (int n = 0; n < count; ++n) {
        float there = enter + (float(n) + 0.5) * each;
        if (cover_at(q + pace * there) < 0.5) continue;
        hit = there;
        break;
    }
    float before = max(hit - each, enter);
    for (int i = 0; i < (hit < 0.0 ? 0 : BISECTIONS); ++i) {
        float middle = 0.5 * (before + hit);
        if (cover_at(q + pace * middle) < 0.5) before = middle;
        else hit = middle;
    }
    vec4 over = vec4(0.0);
    vec3 at = q + pace * hit, rise;
    for (int once = 0; once < (hit < 0.0 ? 0 : 1); ++once) {
        for (int axis = 0; axis < 3; ++axis) {
            vec3 by = vec3(equal(ivec3(0, 1, 2), ivec3(axis)));
            rise[axis] = cover_at(at + by) - cover_at(at - by);
        }
        vec3 normal = index_x.xyz * rise.x + index_y.xyz * rise.y + index_z.xyz * rise.z;
        float light = mix(AMBIENT, 1.0, abs(dot(normal, along)) / max(length(normal), 1e-6));
        float opacity = shell;
        if (GUIDED == 1) {
            // From half a voxel behind the surface on, until one and a half.
            float surface = texelFetch(guide, clamp(ivec2(ray), ivec2(0), textureSize(guide, 0) - 1), 0).x;
            opacity *= mix(1.0, behind, clamp((hit - min(surface, hit)) / voxel - 0.5, 0.0, 1.0));
        }
        vec4 cover, lead;
        over = opacity * vec4(label_colours.entry[look(at, cover, lead)].rgb * light, 1.0);
    }
    return over;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(screen)))) return;
    vec4 over = vec4(0.0);
    ivec2 at = pixel - ivec2(rendering_area.xy);
    bool is_rendering = PLANES == 0 || (all(greaterThanEqual(at, ivec2(0))) && all(lessThan(at, ivec2(rendering_area.zw))));
    if (RENDERING == 1 && is_rendering) {
        // In a pair the volume is the left half.
        if (at.x < 0) at.x = pixel.x;
        over = on_ray((vec2(at) + 0.5) * rays_per_pixel);
    } else if (PLANES == 1) {
        over = on_tile(pixel - ivec2(planes_area.xy), ivec2(planes_area.zw));
    }
    imageStore(screen, pixel, vec4(texelFetch(unlabelled, pixel, 0).rgb * (1.0 - over.a) + over.rgb, 1.0));
}
