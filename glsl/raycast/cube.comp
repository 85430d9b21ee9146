// The volume as a solid block: each ray shows the sample where it enters the block. Where that is outside the insonified
// region, the ray continues until it is inside: the sector's border is then a face.
#version 460
#include "common.glsl"
layout(constant_id = 3) const int EDGES = 1; // lines where two faces meet
layout(scalar) uniform Params {
#include "ray_params.glsl"
    float stride; // longest step of the search for the sector's border, mm
    float shading;
    float edge_strength;
    vec3 edge_colour;
    float slice_pitch; // mean distance of slices: rad (fan) or mm
};
#include "ray.glsl"
readonly buffer Block { vec4 entry[]; } block; // outward normals and limits
uniform writeonly image2D picture;

const int HALVINGS = 6; // 1/64 of a step
// Pixels on either side of an edge over which its line fades. At the block's outline only one side exists, and a narrower
// line would be a row of dots.
const float EDGE_WIDTH = 1.5;

// Cosine of the least angle between faces that meet at an edge, 8 degrees: where a plane touches an arc there is none.
const float SAME_FACE = 0.99;

const int BORDERS = SWEPT ? 6 : SWEEP == 0 ? 0 : 4;

// Outward normal of one of the sector's borders near a point, and in w the distance from the point to the border, mm: first
// and last range, line and slice. `slice` is the point's slice index. The motor's motion during a frame rotates the slices by
// less than a degree and is ignored in their normals.
vec4 border(int n, vec3 p, float slice) {
    float beyond = p.y - axis_depth, rho = SWEEP == 1 ? max(sqrt(beyond * beyond + p.z * p.z), 1e-20) : 1.0;
    // The frame's own depth axis in space.
    vec3 depth = SWEEP == 1 ? vec3(0.0, beyond / rho, p.z / rho) : vec3(0.0, 1.0, 0.0);
    float x = p.x, y = SWEEP == 1 ? rho + axis_depth : p.y;
    float range = ARRAY != 0 ? max(sqrt(x * x + y * y), 1e-20) : y;
    vec3 along = ARRAY != 0 ? (vec3(x, 0.0, 0.0) + depth * y) / range : depth;
    if (n == 0) return vec4(-along, range - range_low);
    if (n == 1) return vec4(along, range_high - range);
    vec3 across = ARRAY != 0 ? (vec3(y, 0.0, 0.0) - depth * x) / range : vec3(1.0, 0.0, 0.0);
    if (n < 4) {
        float limit = n == 2 ? line_low : line_high;
        float line = ARRAY != 0 ? line_at(x, y, range) : x;
        // Of two half tangents: the tangent of half the angle between them.
        float apart = ARRAY == 2 ? 4.0 * range * (atan(limit) - atan(line))
            : ARRAY == 1 ? 2.0 * range * (limit - line) / (1.0 + limit * line) : limit - line;
        return n == 2 ? vec4(-across, -apart) : vec4(across, apart);
    }
    vec3 sweep = SWEEP == 1 ? vec3(0.0, -p.z / rho, beyond / rho) : vec3(0.0, 0.0, 1.0);
    // In mean pitches from the first slice.
    float position = slice, last = last_slice;
    if (NON_UNIFORM == 1) {
        int s = clamp(int(slice), 0, slice_table.entry.length() - 2);
        position = mix(slice_table.entry[s].x, slice_table.entry[s + 1].x, slice - float(s));
        last = slice_table.entry[slice_table.entry.length() - 1].x;
    }
    float pitch = slice_pitch * rho;
    return n == 4 ? vec4(-sweep, position * pitch) : vec4(sweep, (last - position) * pitch);
}

// Distance from a line or a plane through the apex at an angle given by the tangent of its half: a x + b y with a unit
// normal, positive on the side of larger angles.
float beyond_angle(vec2 p, float half_tangent) {
    float t2 = half_tangent * half_tangent;
    return (p.x * (1.0 - t2) - p.y * 2.0 * half_tangent) / (1.0 + t2);
}

// Distance from a scan line of a curved array, mm, positive on the side of larger angles.
float beyond_line(vec2 p, float limit) {
    if (ARRAY == 1) return beyond_angle(p, limit);
    // From the tangent of a quarter of the angle to that of half, as cosine and sine.
    float q2 = limit * limit;
    vec2 half_angle = vec2(1.0 - q2, 2.0 * limit) / (1.0 + q2);
    vec2 angle = vec2(half_angle.x * half_angle.x - half_angle.y * half_angle.y, 2.0 * half_angle.x * half_angle.y);
    return p.x * angle.x - p.y * angle.y;
}

// Lower bound of the distance to the lines of a curved array, mm. Up to 180 degrees of lines lie between two half-planes; beyond, what
// is left out does.
float distance_to_lines(vec2 p) {
    float above = beyond_line(p, line_high), below = -beyond_line(p, line_low);
    bool is_reflex = ARRAY == 2 && atan(line_high) - atan(line_low) > 0.7853982;
    return is_reflex ? min(above, below) : max(above, below);
}

// Lower bound of the distance to the insonified region, mm. Each border is bounded by a sphere, a plane or a cone, and the
// distance to those shrinks no faster than a ray advances.
float distance_to_sector(vec3 p) {
    float y = p.y, x = p.x, distance = 0.0;
    if (SWEEP == 1) y = length(vec2(p.y - axis_depth, p.z)) + axis_depth;
    float range = ARRAY != 0 ? length(vec2(x, y)) : y;
    distance = max(distance, max(range - range_high, range_low - range));
    distance = max(distance, ARRAY != 0 ? distance_to_lines(vec2(x, y)) : max(x - line_high, line_low - x));
    if (SWEPT) {
        vec2 q = vec2(p.z, p.y - axis_depth);
        distance = max(distance, SWEEP == 1 ? max(beyond_angle(q, sweep_high), -beyond_angle(q, sweep_low))
                                            : max(p.z - sweep_high, sweep_low - p.z));
    }
    return distance;
}

void main() {
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, imageSize(picture)))) return;
    vec2 at = vec2(pixel) + 0.5;
    vec3 from = origin + origin_dx * at.x + origin_dy * at.y;
    vec3 unscaled = direction + direction_dx * at.x + direction_dy * at.y;
    vec3 along = normalize(unscaled);
    float enter = 0.0, leave = 3.0e38;
    int face = -1; // the half-space that the ray enters last
    for (int i = 0; i < block.entry.length(); ++i) {
        float towards = dot(block.entry[i].xyz, along);
        float clearance = block.entry[i].w - dot(block.entry[i].xyz, from);
        // Parallel to the face: all of the ray is inside, or none.
        if (abs(towards) < 1e-12) leave = clearance < 0.0 ? -1.0 : leave;
        else if (towards > 0.0) leave = min(leave, clearance / towards);
        else if (clearance / towards > enter) {
            enter = clearance / towards;
            face = i;
        }
    }
    vec4 colour = vec4(0.0);
    if (leave > enter) {
        int steps = max(int(ceil((leave - enter) / stride)), 1);
        float step = (leave - enter) / float(steps);
        // Slightly inside: where a face is the sector's border, rounding must not put the sample outside.
        enter += 0.02 * step;
        int found = -1;
        vec3 texel;
        for (int i = 0; i < steps;) {
            vec3 p = from + along * (enter + float(i) * step);
            if (locate(p, texel)) {
                found = i;
                break;
            }
            // Skip steps that are certainly outside.
            i += max(int(distance_to_sector(p) / step - 0.01), 1);
        }
        if (found >= 0) {
            float outside = enter + float(found - 1) * step, inside = enter + float(found) * step;
            for (int i = 0; i < (found > 0 ? HALVINGS : 0); ++i) {
                float middle = 0.5 * (outside + inside);
                vec3 there;
                if (locate(from + along * middle, there)) inside = middle;
                else outside = middle;
            }
            vec3 p = from + along * inside;
            vec3 normal = face >= 0 ? block.entry[face].xyz : along;
            int own = -1; // the border that is entered
            if (found > 0) {
                vec3 before = from + along * outside;
                locate(before, texel);
                float least = 3.0e38;
                for (int i = 0; i < BORDERS; ++i) {
                    vec4 side = border(i, before, texel.z);
                    if (side.w >= least) continue;
                    least = side.w;
                    normal = side.xyz;
                    own = i;
                }
                face = -1;
            }
            locate(p, texel);
            float grey = sample_volume(texel) * (1.0 - shading * (1.0 - abs(dot(normal, along))));
            colour = vec4(vec3(grey), 1.0);
            if (EDGES == 1 && (face >= 0 || own >= 0)) {
                // Displacement on the face over one pixel.
                float scale = inside / length(unscaled);
                vec3 ex = origin_dx + direction_dx * scale, ey = origin_dy + direction_dy * scale;
                float facing = min(dot(normal, along), -1e-3);
                ex -= along * (dot(normal, ex) / facing);
                ey -= along * (dot(normal, ey) / facing);
                float near = 0.0;
                int halves = block.entry.length();
                for (int i = 0; i < halves + BORDERS; ++i) {
                    vec4 other;
                    if (i < halves) {
                        other = block.entry[i];
                        other.w -= dot(other.xyz, p);
                    } else other = border(i - halves, p, texel.z);
                    float pixels = other.w / max(length(vec2(dot(other.xyz, ex), dot(other.xyz, ey))), 1e-20);
                    bool is_own = i == face || (i >= halves && i - halves == own) || dot(other.xyz, normal) >= SAME_FACE;
                    near = max(near, is_own ? 0.0 : EDGE_WIDTH - pixels);
                }
                colour.rgb = mix(colour.rgb, edge_colour, edge_strength * clamp(near, 0.0, 1.0));
            }
        }
    }
    imageStore(picture, pixel, colour);
}
