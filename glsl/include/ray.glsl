// Rays, the map from space to the sweep, and sampling of the volume: shared by all ray casters. Tables that a geometry does not need are
// not bound; the constants keep them from being read.

layout(constant_id = 0) const int SWEEP = 1;    // 0 Cartesian, 1 fan, 2 translated, 3 still
layout(constant_id = 1) const int ARRAY = 1;    // 0 linear, 1 curved, 2 curved with lines 90 degrees or more off the axis
layout(constant_id = 2) const int SAMPLING = 0; // 0 the device's filter, 1 eight fetches; packed neighbours: 2 one load of eight
                                                // bytes, two loads of four values: 3 of 16 bits of 0..1, 4 of half floats
layout(constant_id = 19) const int ELEVATION = 0; // between slices: 0 linear, 1 the uniform cubic B-spline
layout(constant_id = 20) const int CLIPS = 0;   // clip planes
layout(constant_id = 21) const int SPREAD = 0;  // 1: steps grow with the range, as the sample spacing of a convex sweep does
layout(constant_id = 36) const int INTRA_FRAME_MOTION = 0; // 1: the motor moves while a frame is acquired
layout(constant_id = 37) const int NON_UNIFORM = 0; // 1: slices at non-uniform positions or of mixed directions
layout(constant_id = 38) const int SWEEP_TERMS = 0; // of the polynomial from a sweep position to a slice; 0: the look-up table
layout(constant_id = 44) const int MIRRORED = 0; // the sector is its own mirror image: 1 in the lines, 2 in the sweep, 3 in both
layout(constant_id = 22) const int SLIDING = 0; // 3 or 5: edge of the Gaussian that slides along the ray

#include "stored_volume.glsl"
uniform sampler3D volume;
uniform utexture3D packed_neighbours;
readonly buffer SweepLut { float entry[]; } sweep_lut;      // of SWEPT without a polynomial
readonly buffer LineLut { float entry[]; } line_lut;        // of INTRA_FRAME_MOTION
readonly buffer SliceTable { vec2 entry[]; } slice_table;   // of NON_UNIFORM: position and advance, in mean pitches

const bool SWEPT = SWEEP == 1 || SWEEP == 2; // fan or translated
const bool LINES_MIRRORED = MIRRORED == 1 || MIRRORED == 3, SWEEP_MIRRORED = MIRRORED == 2 || MIRRORED == 3;

// Not from the texture's size: what is queried is kept for every invocation, a parameter once for all.
ivec3 last_stored = ivec3(last_stored_column, last_stored_row, last_stored_slice);

// The pixel of an invocation. A CPU takes eight invocations of a row at once, for as long as the longest of their rays needs: as four by two pixels they are closer
// to each other than in a row.
ivec2 ray_pixel() {
    ivec2 n = ivec2(gl_LocalInvocationID.xy);
    return 8 * ivec2(gl_WorkGroupID.xy) + ivec2((n.x & 3) + 4 * (n.y & 1), (n.x >> 2) + 2 * (n.y >> 1));
}

struct Ray {
    vec3 origin;
    vec3 direction;
    float enter;
    float leave;
    // Steps that grow: step n is `first` exp(n `growth`) mm long.
    float first;
    float growth;
};

// (e^x - 1) / x without losing a small x.
float growth_over(float x) {
    float series = 1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0 * (1.0 + x / 7.0)))));
    return abs(x) < 0.5 ? series : (exp(x) - 1.0) / x;
}

// ln(1 + x) / x without losing a small x.
float decline_over(float x) {
    float series = 1.0 - x * (1.0 / 2.0 - x * (1.0 / 3.0 - x * (1.0 / 4.0 - x * (1.0 / 5.0 - x * (1.0 / 6.0 - x / 7.0)))));
    return abs(x) < 0.1 ? series : log(1.0 + x) / x;
}

// Ratio of the step to `step_length` at a point: proportional to the range from the array's apex, at most 8.
float widening(vec3 p) {
    float x = p.x, y = p.y;
    if (SWEEP == 1) {
        float beyond = p.y - axis_depth;
        y = sqrt(beyond * beyond + p.z * p.z) + axis_depth;
    }
    return 1.0 + spread * (clamp(sqrt(x * x + y * y) / spread_range, 1.0, 8.0) - 1.0);
}

// Distance from the ray's entry after n steps, mm.
//
// `precise` here and below: a compiler may fuse a multiplication with an addition or not, as the code around it decides. Passes that
// share samples are to have the same samples to the last bit.
float offset_of(Ray ray, float n) {
    precise float even = n * step_length;
    return SPREAD == 0 ? even : ray.first * n * growth_over(n * ray.growth) / growth_over(ray.growth);
}

// The place that many mm behind the ray's entry.
vec3 place_at(Ray ray, float along) {
    precise vec3 p = ray.origin + ray.direction * (ray.enter + along);
    return p;
}

// Length of the step that begins after n steps, mm.
float length_of(Ray ray, float n) { return SPREAD == 0 ? step_length : ray.first * exp(n * ray.growth); }

// Number of steps to an offset: the inverse of `offset_of`.
float steps_to(Ray ray, float offset) {
    if (SPREAD == 0) return offset / step_length;
    float n = offset * growth_over(ray.growth) / ray.first;
    return n * decline_over(max(n * ray.growth, -0.999999));
}

vec4 clip_at(int i) { return i == 0 ? clip_0 : i == 1 ? clip_1 : i == 2 ? clip_2 : clip_3; }

// Lets a ray begin at a place of the picture.
void aim(inout Ray ray, vec2 at) {
    ray.origin = origin + origin_dx * at.x + origin_dy * at.y;
    ray.direction = normalize(direction + direction_dx * at.x + direction_dy * at.y);
}

// The ray through a place of the picture, rays from its upper left corner, and its interval inside the box and on the near side of every clip plane; leave < enter is a miss. A ray
// parallel to a face would divide by zero: min and max order the infinities correctly, and the smallest component of 1e-12
// avoids the 0/0 of a ray within the face's plane. `face` is the clip plane that the ray enters through, -1 if there is none.
Ray ray_through(vec2 at, out int face) {
    Ray ray;
    aim(ray, at);
    vec3 d = mix(ray.direction, vec3(1e-12), lessThan(abs(ray.direction), vec3(1e-12)));
    vec3 a = (box_low - ray.origin) / d;
    vec3 b = (box_high - ray.origin) / d;
    vec3 near = min(a, b), far = max(a, b);
    ray.enter = max(max(near.x, near.y), max(near.z, 0.0));
    ray.leave = min(far.x, min(far.y, far.z));
    face = -1;
    for (int i = 0; i < CLIPS; ++i) {
        vec4 plane = clip_at(i);
        float towards = dot(plane.xyz, ray.direction);
        float clearance = plane.w - dot(plane.xyz, ray.origin);
        // Parallel to the plane: keep all of the ray, or none.
        if (abs(towards) < 1e-12) ray.leave = clearance < 0.0 ? -1.0 : ray.leave;
        else if (towards > 0.0) ray.leave = min(ray.leave, clearance / towards);
        else if (clearance / towards > ray.enter) {
            ray.enter = clearance / towards;
            face = i;
        }
    }
    ray.first = step_length;
    ray.growth = 0.0;
    if (SPREAD == 1 && ray.leave > ray.enter) {
        // Linear between the ray's ends, so that the position of step n has a closed form.
        float low = widening(ray.origin + ray.direction * ray.enter);
        float high = widening(ray.origin + ray.direction * ray.leave);
        ray.growth = step_length * (high - low) / (ray.leave - ray.enter);
        ray.first = step_length * low * growth_over(ray.growth);
    }
    return ray;
}

Ray ray_of(ivec2 pixel, out int face) { return ray_through(vec2(pixel) + 0.5, face); }

Ray ray_of(ivec2 pixel) {
    int face;
    return ray_of(pixel, face);
}

// Limits of a place's coordinates in the sector: range, line, entry of the sweep table or position in the sweep, slice. An index that rounding puts just
// beyond the outermost frame is still inside.
struct Sector {
    vec4 low;
    vec4 high;
};

Sector sector() {
    vec2 sweep = vec2(0.0);
    float slices = 0.0;
    if (SWEPT) {
        sweep = SWEEP_TERMS > 0 ? vec2(sweep_first, sweep_last) : vec2(0.0, float(sweep_lut.entry.length() - 1));
        slices = NON_UNIFORM == 1 ? float(slice_table.entry.length() - 1) : last_slice;
    }
    return Sector(vec4(range_low, line_low, sweep.x, -1e-4), vec4(range_high, line_high, sweep.y, slices + 1e-4));
}

// Tangent of a quarter of the angle off the depth axis, for angles up to 180 degrees: that of half the angle has no bound. Of the sine
// and the cosine of half the angle the larger is a root, and the smaller follows from the sine, so that nothing cancels.
float quarter_tangent(float x, float y, float range) {
    range = max(range, 1e-20);
    float larger = sqrt(0.5 + 0.5 * abs(y) / range), smaller = 0.5 * abs(x) / (range * larger);
    float t = y >= 0.0 ? smaller / (1.0 + larger) : larger / (1.0 + smaller);
    return x < 0.0 ? -t : t;
}

// Parameter of the line through an in-plane point of a curved array, see `line_parts` of lookup_tables.rs.
float line_at(float x, float y, float range) {
    return ARRAY == 2 ? quarter_tangent(x, y, range) : x / max(range + y, 1e-20);
}

// Slice index at a position of the sweep: mm, or of a fan the tangent of half the angle about the wobble axis. `line` is the line's
// parameter. `e` is the entry of the look-up table, or the position where a polynomial takes its place. No trigonometry either way.
float slice_at(float position, float line, out float e) {
    float k;
    if (SWEEP_TERMS > 0) {
        e = position;
        // Odd in the position.
        float t = position, square = t * t, sum = 0.0;
        if (SWEEP_TERMS > 9) sum = fma(sum, square, sweep_terms_2.y);
        if (SWEEP_TERMS > 8) sum = fma(sum, square, sweep_terms_2.x);
        if (SWEEP_TERMS > 7) sum = fma(sum, square, sweep_terms_1.w);
        if (SWEEP_TERMS > 6) sum = fma(sum, square, sweep_terms_1.z);
        if (SWEEP_TERMS > 5) sum = fma(sum, square, sweep_terms_1.y);
        if (SWEEP_TERMS > 4) sum = fma(sum, square, sweep_terms_1.x);
        if (SWEEP_TERMS > 3) sum = fma(sum, square, sweep_terms_0.w);
        if (SWEEP_TERMS > 2) sum = fma(sum, square, sweep_terms_0.z);
        if (SWEEP_TERMS > 1) sum = fma(sum, square, sweep_terms_0.y);
        k = fma(t, fma(sum, square, sweep_terms_0.x), sweep_offset);
    } else {
        e = (position - sweep_low) * sweep_density;
        int last = sweep_lut.entry.length() - 1;
        int i = clamp(int(e), 0, last - 1);
        k = mix(sweep_lut.entry[i], sweep_lut.entry[i + 1], clamp(e - float(i), 0.0, 1.0));
    }
    // Share of the frame's lines that fired before this one.
    float share = 0.0;
    if (INTRA_FRAME_MOTION == 1) {
        float l = clamp((line - line_low) * line_density, 0.0, float(line_lut.entry.length() - 1));
        int j = clamp(int(l), 0, line_lut.entry.length() - 2);
        share = mix(line_lut.entry[j], line_lut.entry[j + 1], l - float(j));
    }
    if (NON_UNIFORM == 1) {
        // Bracketing: positions increase from slice to slice for every line, and the uniform guess is rarely off by more than one.
        int slices = slice_table.entry.length();
        int s = clamp(int(k), 0, slices - 2);
        while (s > 0 && slice_table.entry[s].x + slice_table.entry[s].y * share > k) --s;
        while (s + 2 < slices && slice_table.entry[s + 1].x + slice_table.entry[s + 1].y * share <= k) ++s;
        float here = slice_table.entry[s].x + slice_table.entry[s].y * share;
        float next = slice_table.entry[s + 1].x + slice_table.entry[s + 1].y * share;
        k = float(s) + (k - here) / (next - here);
    } else if (INTRA_FRAME_MOTION == 1) {
        k -= advance * share;
    }
    return k;
}

// A point's depth in the plane of its frame, and the position of that frame in the sweep.
void in_frame(vec3 p, out float y, out float position) {
    y = p.y;
    position = p.z;
    if (SWEEP == 1) {
        float beyond = p.y - axis_depth;
        float rho = sqrt(beyond * beyond + p.z * p.z);
        y = rho + axis_depth;
        // Opposite the sweep it is large, and with a polynomial its square is to be finite.
        position = p.z / max(rho + beyond, SWEEP_TERMS > 0 ? 1e-12 : 1e-20);
    }
}

// Texture indices (column, row, slice) of a point in space, and its coordinates in the sector; false outside the insonified region.
bool locate(vec3 p, out vec3 texel, out vec4 place) {
    place = vec4(0.0);
    if (SWEEP == 0) {
        texel = vec3((p.xy - grid_origin) * grid_density, (p.z - slice_origin) * slice_density);
        return true;
    }
    float x = p.x, y, position;
    in_frame(p, y, position);
    float range = y, line = x;
    if (ARRAY != 0) {
        range = sqrt(x * x + y * y);
        line = line_at(x, y, range);
    }
    float e = 0.0, k = 0.0;
    // What is beyond the limits is outside, and the polynomial is not meant for it.
    if (SWEPT) k = slice_at(SWEEP_TERMS > 0 ? clamp(position, sweep_low, sweep_high) : position, line, e);
    if (SWEEP_TERMS > 0) e = position;
    texel = vec3((vec2(x, y) - grid_origin) * grid_density, k);
    place = vec4(range, line, e, k);
    Sector limits = sector();
    return all(bvec2(all(greaterThanEqual(place, limits.low)), all(lessThanEqual(place, limits.high))));
}

// The same without the coordinates. Between lines less than 90 degrees off the axis, squares of ranges and the sides of the first and the
// last line need neither a root nor a quotient.
bool locate(vec3 p, out vec3 texel) {
    vec4 place;
    if (SWEEP == 0 || ARRAY != 1 || SWEEP_TERMS == 0 || INTRA_FRAME_MOTION == 1) return locate(p, texel, place);
    float y, position, e;
    in_frame(p, y, position);
    vec2 at = vec2(p.x, y);
    // What the position leaves outside needs no index. Non-uniform slices decide by the index, which the polynomial gives within its limits.
    float within = NON_UNIFORM == 1 ? clamp(position, sweep_low, sweep_high) : position;
    float square = dot(at, at), k = slice_at(within, 0.0, e);
    texel = vec3((at - grid_origin) * grid_density, k);
    // Not by `&&`, which branches at every comparison.
    bvec2 in_range = bvec2(square >= range_low_squared, square <= range_high_squared);
    // The line on the same side decides alone where the other is its mirror image.
    bvec2 in_lines = bvec2(LINES_MIRRORED ? dot(vec2(abs(at.x), at.y), last_line) >= 0.0 : dot(at, first_line) >= 0.0,
                           LINES_MIRRORED || dot(at, last_line) >= 0.0);
    bvec2 in_sweep = bvec2(SWEEP_MIRRORED ? abs(position) <= sweep_border_high : position >= sweep_border_low,
                           SWEEP_MIRRORED || position <= sweep_border_high);
    if (NON_UNIFORM == 1) in_sweep = bvec2(k >= -1e-4, k <= float(slice_table.entry.length() - 1) + 1e-4);
    return all(bvec3(all(in_range), all(in_lines), all(in_sweep)));
}

// Share of a step that is inside the sector, between the coordinates of an end inside and of one outside: along a step each
// coordinate changes nearly evenly.
float share_inside(vec4 inner, vec4 outer) {
    Sector s = sector();
    vec4 border = clamp(outer, s.low, s.high);
    vec4 shares = mix(vec4(1.0), (border - inner) / (outer - inner), notEqual(outer, border));
    return clamp(min(min(shares.x, shares.y), min(shares.z, shares.w)), 0.0, 1.0);
}

// At coordinates in the stored part.
float fetch(ivec3 at) { return texelFetch(volume, at, 0).x; }

// A texel of a slice, the next column's, the next row's, and the diagonal neighbour's, in units of NEIGHBOUR_UNIT; coordinates in the stored
// part.
const float NEIGHBOUR_UNIT = SAMPLING == 2 ? 1.0 / 255.0 : SAMPLING == 3 ? 1.0 / 65535.0 : 1.0;
vec4 plane_at(ivec2 low, ivec2 high, int slice) {
    if (SAMPLING == 1)
        return vec4(fetch(ivec3(low, slice)), fetch(ivec3(high.x, low.y, slice)), fetch(ivec3(low.x, high.y, slice)), fetch(ivec3(high, slice)));
    uvec2 bits = texelFetch(packed_neighbours, ivec3(low, slice), 0).xy;
    if (SAMPLING == 3) return vec4(ivec4(bits.xxyy >> uvec4(0, 16, 0, 16)) & 65535);
    return vec4(unpackHalf2x16(bits.x), unpackHalf2x16(bits.y));
}

vec4 bytes_of(uint bits) { return vec4(ivec4(bits.xxxx >> uvec4(0, 8, 16, 24)) & 255); }

// The same in two slices that are the same or follow each other.
vec4[2] planes_at(ivec2 low, ivec2 high, ivec2 slices) {
    if (SAMPLING != 2) return vec4[](plane_at(low, high, slices.x), plane_at(low, high, slices.y));
    // A texel has the neighbours in its own slice and in the next one.
    uvec2 bits = texelFetch(packed_neighbours, ivec3(low, slices.x), 0).xy;
    // Only the B-spline asks for the same slice twice, where more than a border repeats.
    return vec4[](bytes_of(bits.x), bytes_of(ELEVATION == 1 && slices.y == slices.x ? bits.x : bits.y));
}

float filtered_by_device(vec3 texel) {
    return textureLod(volume, (texel + texture_shift) * texture_scale, 0.0).x;
}

// The uniform cubic B-spline across the slices k - 1 to k + 2 around a place, without a prefilter; bilinear within a slice. The device's filter is
// asked at the slices themselves: two fetches between slices would do (Sigg and Hadwiger 2005, GPU Gems 2, chapter 20), but a GPU rounds a weight
// to 1/256, and of the ripple between slices 0.63 was left on an H100 instead of 0.28.
float bspline_volume(vec3 texel) {
    // Two slices beyond the border nothing changes any more.
    float z = clamp(texel.z, float(first_stored.z - 2), float(last_stored.z + 2));
    float k = floor(z), t = z - k, s = 1.0 - t;
    vec4 w = vec4(s * s * s, 4.0 - t * t * (6.0 - 3.0 * t), 4.0 - s * s * (6.0 - 3.0 * s), t * t * t) / 6.0;
    if (SAMPLING == 0) {
        return w.x * filtered_by_device(vec3(texel.xy, k - 1.0)) + w.y * filtered_by_device(vec3(texel.xy, k))
             + w.z * filtered_by_device(vec3(texel.xy, k + 1.0)) + w.w * filtered_by_device(vec3(texel.xy, k + 2.0));
    }
    vec2 at = clamp(texel.xy, vec2(first_stored.xy), vec2(last_stored.xy));
    ivec2 low = ivec2(at), high = min(low + 1, last_stored.xy) - first_stored.xy;
    vec2 share = at - vec2(low);
    low -= first_stored.xy;
    ivec4 slices = clamp(int(k) + ivec4(-1, 0, 1, 2), first_stored.z, last_stored.z) - first_stored.z;
    vec4 first[2] = planes_at(low, high, slices.xy), second[2] = planes_at(low, high, slices.zw);
    vec4 plane = w.x * first[0] + w.y * first[1] + w.z * second[0] + w.w * second[1];
    vec2 row = mix(plane.xz, plane.yw, share.x);
    return mix(row.x, row.y, share.y) * NEIGHBOUR_UNIT;
}

// The volume at texture indices; beyond the border it repeats the nearest texel. Beyond the stored part no sample is needed. Indices are
// shifted to the image as integers, so that the same texels get the same weights wherever the stored part begins; the device's filter
// divides by the image's size.
float raw_volume(vec3 texel) {
    if (ELEVATION == 1) return bspline_volume(texel);
    if (SAMPLING == 0) return filtered_by_device(texel);
    vec3 at = clamp(texel, vec3(first_stored), vec3(last_stored));
    ivec3 low = ivec3(at), high = min(low + 1, last_stored) - first_stored;
    vec3 w = at - vec3(low);
    low -= first_stored;
    vec4 planes[2] = planes_at(low.xy, high.xy, ivec2(low.z, high.z));
    vec4 plane = mix(planes[0], planes[1], w.z);
    vec2 row = mix(plane.xz, plane.yw, w.x);
    return mix(row.x, row.y, w.y) * NEIGHBOUR_UNIT;
}

// A sample stretched by a grey window that begins at `low`.
float stretched(float value, float low, float scale) {
    precise float share = (value - low) * scale;
    return clamp(share, 0.0, 1.0);
}

float windowed(float value) { return stretched(value, window_low, window_scale); }
float sample_volume(vec3 texel) { return windowed(raw_volume(texel)); }
