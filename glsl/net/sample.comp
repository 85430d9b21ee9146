// Values of a slab of a lattice: trilinear between the stored samples, in the units in which they are stored; UNKNOWN outside of the insonified region.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int SWEEP = 1;       // 0 Cartesian, 1 fan, 2 translated, 3 still
layout(constant_id = 1) const int ARRAY = 1;       // 0 linear, 1 curved
layout(constant_id = 2) const int LINE_TABLE = 0;  // 1: lines at non-uniform positions
layout(constant_id = 3) const int SLICE_TABLE = 0; // 1: slices at non-uniform positions or of mixed directions
layout(scalar) uniform Params {
    vec3 first;        // place of the lattice's first voxel, mm; of a Cartesian volume the index of its voxel
    vec3 step;         // to the next voxel
    float axis_depth;  // y of the wobble axis, mm
    float first_range; // of the first sample, mm
    float sample_pitch;
    float first_line;  // rad or mm
    float line_pitch;
    float first_slice; // rad or mm
    float slice_pitch;
    float advance;     // of the motor during a frame, rad or mm
    float scale;       // stored value of a texel of 1
    int left_out;      // rows that count as not known
    int first_stored;  // slice of the slab
    vec3 slack;        // of indices at the border, by rounding
};
uniform texture3D net_samples; // samples of a line, lines, frames
readonly buffer NetLines { float entry[]; } net_lines;   // positions
readonly buffer NetSlices { vec2 entry[]; } net_slices;  // positions when line 0 was acquired, and advances
uniform writeonly image3D net_values;
#include "net_values.glsl"

// The angle off an axis. By halves down to an eighth, of which a short series is exact: drivers may round atan to 2e-4 of it.
float angle_of(float opposite, float adjacent) {
    float radius = sqrt(opposite * opposite + adjacent * adjacent);
    if (radius == 0.0) return 0.0;
    // Tangent of half the angle, without cancellation.
    float t = adjacent >= 0.0 ? opposite / (radius + adjacent)
                              : (radius - adjacent) / (abs(opposite) < 1e-20 ? 1e-20 : opposite);
    for (int n = 0; n < 2; ++n) {
        float wide = min(abs(t), 1e18);
        t = sign(t) * wide / (1.0 + sqrt(1.0 + wide * wide));
    }
    float s = t * t;
    float series = 1.0 - s * (1.0 / 3.0 - s * (1.0 / 5.0 - s * (1.0 / 7.0 - s * (1.0 / 9.0 - s * (1.0 / 11.0 - s / 13.0)))));
    return 8.0 * t * series;
}

float line_of(float at) {
    if (LINE_TABLE == 0) return (at - first_line) / line_pitch;
    int low = 0, high = net_lines.entry.length() - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (net_lines.entry[middle] <= at) low = middle;
        else high = middle;
    }
    float from = net_lines.entry[low];
    return float(low) + (at - from) / (net_lines.entry[high] - from);
}

// `share`: of the frame's lines that fired before.
float slice_of(float position, float share) {
    if (textureSize(net_samples, 0).z == 1) return 0.0;
    if (SLICE_TABLE == 0) return (position - advance * share - first_slice) / slice_pitch;
    int low = 0, high = net_slices.entry.length() - 1;
    while (high - low > 1) {
        int middle = (low + high) / 2;
        if (net_slices.entry[middle].x + net_slices.entry[middle].y * share <= position) low = middle;
        else high = middle;
    }
    vec2 from = net_slices.entry[low], to = net_slices.entry[high];
    float begin = from.x + from.y * share;
    return float(low) + (position - begin) / (to.x + to.y * share - begin);
}

// The index of the sample at a place, mm.
vec3 index_of(vec3 p) {
    float y = p.y, position = SWEEP == 2 ? p.z : 0.0;
    if (SWEEP == 1) {
        float beyond = p.y - axis_depth;
        y = sqrt(beyond * beyond + p.z * p.z) + axis_depth;
        position = angle_of(p.z, beyond);
    }
    float range = ARRAY == 1 ? sqrt(p.x * p.x + y * y) : y;
    float line = line_of(ARRAY == 1 ? angle_of(p.x, y) : p.x);
    return vec3((range - first_range) / sample_pitch, line, slice_of(position, line / float(textureSize(net_samples, 0).y)));
}

float sample_at(ivec3 at) {
    float texel = texelFetch(net_samples, at, 0).x;
    return scale == 1.0 ? texel : floor(texel * scale + 0.5);
}

void main() {
    ivec3 to = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(to, imageSize(net_values)))) return;
    // By its place in the whole lattice, so that slabs round as one does.
    vec3 place = first + step * vec3(to.xy, to.z + first_stored);
    vec3 at = SWEEP == 0 ? place : index_of(place);
    ivec3 last = textureSize(net_samples, 0) - 1;
    float value = UNKNOWN;
    if (to.y >= left_out && all(greaterThanEqual(at, -slack)) && all(lessThanEqual(at, vec3(last) + slack))) {
        at = clamp(at, vec3(0.0), vec3(last));
        ivec3 low = min(ivec3(at), max(last - 1, ivec3(0))), high = min(low + 1, last);
        vec3 share = at - vec3(low);
        vec4 along;
        for (int n = 0; n < 4; ++n) {
            ivec2 there = ivec2((n & 1) == 1 ? high.y : low.y, n > 1 ? high.z : low.z);
            along[n] = mix(sample_at(ivec3(low.x, there)), sample_at(ivec3(high.x, there)), share.x);
        }
        vec2 across = mix(along.xz, along.yw, share.y);
        value = mix(across.x, across.y, share.z);
    }
    imageStore(net_values, to, vec4(value, 0.0, 0.0, 0.0));
}
