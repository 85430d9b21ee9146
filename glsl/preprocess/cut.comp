// What cuts remove, and what is in front of the render start, set to a value of which nothing is drawn; all else as it is. A texel is removed if
// its centre is. All images hold the stored part of the volume.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int SWEEP = 1;               // 0 Cartesian, 1 fan, 2 translated, 3 still
layout(constant_id = 2) const int CUTS = 1;                // 1: there are some
layout(constant_id = 3) const int UNVEILS = 0;             // 1: rendering starts at a surface
layout(constant_id = 4) const int CURVED_START = 0;        // 1: rendering starts at a curve
layout(constant_id = 36) const int INTRA_FRAME_MOTION = 0; // 1: the motor moves while a frame is acquired
layout(scalar) uniform Params {
    float removed; // the value of what is removed
    int cut_count;
    vec2 grid_origin;
    vec2 grid_pitch;
    float axis_depth;
#include "slice_params.glsl"
};
#include "stored_volume.glsl"
uniform texture3D source;
uniform texture2D line_shares; // of INTRA_FRAME_MOTION: share of the frame's lines that fired before the one at a texel
readonly buffer SlicePlaces { vec4 entry[]; } slice_places; // of a fan cosine and sine of the angle, otherwise z in y; then the motor's advance
readonly buffer Cuts { vec4 entry[]; } cuts;                // each: HEADER entries, then an edge of its contour in each
uniform texture2D start_surface; // of UNVEILS: by column and slice, the row at which rendering starts
uniform texture2D start_curve;   // of CURVED_START: the same
uniform writeonly image3D target;

const int HEADER = 5;

// The place in space of a texel of the whole volume.
vec3 place_of(ivec3 at) {
    vec2 in_plane = grid_origin + vec2(at.xy) * grid_pitch;
    vec4 slice_place = slice_places.entry[at.z];
    float moved = INTRA_FRAME_MOTION == 1 ? slice_place.z * texelFetch(line_shares, at.xy, 0).x : 0.0;
    if (SWEEP != 1) return vec3(in_plane, slice_place.y + moved);
    // The angle is the sum of that of the slice and of what the motor moved since. The latter is small: its series have the precision of f32,
    // which the device's own sine and cosine need not have.
    float square = moved * moved;
    float cosine = 1.0 - square / 2.0 * (1.0 - square / 12.0 * (1.0 - square / 30.0));
    float sine = moved * (1.0 - square / 6.0 * (1.0 - square / 20.0 * (1.0 - square / 42.0)));
    vec2 turned = vec2(slice_place.x * cosine - slice_place.y * sine, slice_place.y * cosine + slice_place.x * sine);
    return vec3(in_plane.x, vec2(axis_depth, 0.0) + (in_plane.y - axis_depth) * turned);
}

// True if a contour winds about a point (Sunday 2001). An edge belongs to its lower end only.
bool winds_about(vec2 p, int first, int end) {
    int winding = 0;
    for (int n = first; n < end; ++n) {
        vec4 edge = cuts.entry[n];
        bool from_above = edge.y > p.y, to_above = edge.w > p.y;
        if (from_above == to_above) continue;
        float side = (edge.z - edge.x) * (p.y - edge.y) - (edge.w - edge.y) * (p.x - edge.x);
        if (to_above && side > 0.0) ++winding;
        if (from_above && side < 0.0) --winding;
    }
    return winding != 0;
}

// True if a point is within a radius of the strokes of a brush. The w of a point is 1 where a stroke begins.
bool is_brushed(vec3 p, float radius, int first, int end) {
    vec3 from = vec3(0.0);
    for (int n = first; n < end; ++n) {
        vec4 point = cuts.entry[n];
        if (point.w > 0.5) from = point.xyz;
        vec3 along = point.xyz - from, off = p - from;
        float square = dot(along, along);
        vec3 away = off - along * (square > 0.0 ? clamp(dot(off, along) / square, 0.0, 1.0) : 0.0);
        if (dot(away, away) <= radius * radius) return true;
        from = point.xyz;
    }
    return false;
}

bool is_removed(vec3 p) {
    int first = 0;
    for (int n = 0; n < cut_count; ++n) {
        vec4 right = cuts.entry[first], up = cuts.entry[first + 1], forward = cuts.entry[first + 2];
        vec4 limits = cuts.entry[first + 3]; // distance of the eye or 0, depth, 1 if the inside is removed, edges; of a brush radius, 0, 2, points
        vec4 bounds = cuts.entry[first + 4];
        int edges = first + HEADER, end = edges + int(limits.w);
        first = end;
        if (limits.z > 1.5) {
            // Of a brush, the first two are the corners of its bounds.
            bool may_be = all(greaterThanEqual(p, right.xyz)) && all(lessThanEqual(p, up.xyz));
            if (may_be && is_brushed(p, limits.x, edges, end)) return true;
            continue;
        }
        float behind = dot(forward.xyz, p) + forward.w;
        if (behind > limits.y) continue;
        vec2 across = vec2(dot(right.xyz, p) + right.w, dot(up.xyz, p) + up.w);
        bool is_seen = true;
        if (limits.x > 0.0) {
            is_seen = behind + limits.x > 0.0;
            if (is_seen) across *= limits.x / (behind + limits.x);
        }
        bool is_inside = is_seen && all(greaterThanEqual(across, bounds.xy)) && all(lessThanEqual(across, bounds.zw)) && winds_about(across, edges, end);
        if (is_inside == (limits.z > 0.5)) return true;
    }
    return false;
}

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID) + ivec3(first_column, first_row, slice);
    ivec3 stored = at - first_stored;
    if (any(greaterThanEqual(stored, imageSize(target)))) return;
    bool is_drawn = CUTS == 0 || !is_removed(place_of(at));
    if (UNVEILS == 1) is_drawn = is_drawn && float(at.y) >= texelFetch(start_surface, at.xz, 0).x;
    if (CURVED_START == 1) is_drawn = is_drawn && float(at.y) >= texelFetch(start_curve, at.xz, 0).x;
    float value = is_drawn ? texelFetch(source, stored, 0).x : removed;
    imageStore(target, stored, vec4(value, 0.0, 0.0, 0.0));
}
