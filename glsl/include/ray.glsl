// Rays, the sweep map, and sampling of the volume: what both ray casters share. Variants:
//   plain   Cartesian or a single frame: no table
//   SWEPT   fan or translated: the sweep look-up table
//   MOVED   the motor travels while a frame is acquired: the line look-up table
//   UNEVEN  slices at uneven places or of mixed directions: the slice table

layout(constant_id = 0) const int SWEEP = 1;    // 0 Cartesian, 1 fan, 2 translated, 3 still
layout(constant_id = 1) const int ARRAY = 1;    // 0 linear, 1 curved
layout(constant_id = 2) const int SAMPLING = 0; // 0 the device's filter, 1 eight fetches
layout(constant_id = 20) const int CLIPS = 0;   // planes that cut

uniform sampler3D volume;
#ifdef SWEPT
readonly buffer SweepLut { float entry[]; } sweep_lut;
#endif
#ifdef MOVED
readonly buffer LineLut { float entry[]; } line_lut;
#endif
#ifdef UNEVEN
readonly buffer SliceTable { vec2 entry[]; } slice_table; // position and advance, in mean pitches
#endif

struct Ray {
    vec3 origin;
    vec3 direction;
    float enter;
    float leave;
};

// The ray of a pixel and where it lies in the box, on the near side of every clip plane; leave < enter is a miss. A ray
// parallel to a face divides by zero: the infinities are ordered rightly by min and max, and the 0/0 of a ray within the
// face's plane is avoided by the nudge.
Ray ray_of(ivec2 pixel) {
    vec2 at = vec2(pixel) + 0.5;
    Ray ray;
    ray.origin = origin + origin_dx * at.x + origin_dy * at.y;
    ray.direction = normalize(direction + direction_dx * at.x + direction_dy * at.y);
    vec3 d = mix(ray.direction, vec3(1e-12), lessThan(abs(ray.direction), vec3(1e-12)));
    vec3 a = (box_low - ray.origin) / d;
    vec3 b = (box_high - ray.origin) / d;
    vec3 near = min(a, b), far = max(a, b);
    ray.enter = max(max(near.x, near.y), max(near.z, 0.0));
    ray.leave = min(far.x, min(far.y, far.z));
    for (int i = 0; i < CLIPS; ++i) {
        vec4 plane = i == 0 ? clip_0 : i == 1 ? clip_1 : i == 2 ? clip_2 : clip_3;
        float towards = dot(plane.xyz, ray.direction);
        float room = plane.w - dot(plane.xyz, ray.origin);
        // Parallel to the plane: all of the ray is kept, or none.
        if (abs(towards) < 1e-12) ray.leave = room < 0.0 ? -1.0 : ray.leave;
        else if (towards > 0.0) ray.leave = min(ray.leave, room / towards);
        else ray.enter = max(ray.enter, room / towards);
    }
    return ray;
}

// Texture indices (column, row, slice) of a place in space; false outside the insonified region. No trigonometry: the
// angle about the wobble axis enters as the tangent of its half, z / (rho + y), through the look-up table.
bool locate(vec3 p, out vec3 texel) {
    if (SWEEP == 0) {
        texel = vec3((p.xy - grid_origin) * grid_density, (p.z - slice_origin) * slice_density);
        return true;
    }
    float x = p.x, y = p.y, position = p.z;
    if (SWEEP == 1) {
        float beyond = p.y - axis_depth;
        float rho = sqrt(beyond * beyond + p.z * p.z);
        y = rho + axis_depth;
        position = p.z / max(rho + beyond, 1e-20);
    }
    float range = y, line = x;
    if (ARRAY == 1) {
        range = sqrt(x * x + y * y);
        line = x / max(range + y, 1e-20);
    }
    bool inside = range >= range_low && range <= range_high && line >= line_low && line <= line_high;
    float k = 0.0;
#ifdef SWEPT
    float e = (position - sweep_low) * sweep_density;
    int last = sweep_lut.entry.length() - 1;
    inside = inside && e >= 0.0 && e <= float(last);
    int i = clamp(int(e), 0, last - 1);
    k = mix(sweep_lut.entry[i], sweep_lut.entry[i + 1], clamp(e - float(i), 0.0, 1.0));
#ifdef MOVED
    // Share of the frame's lines fired before this one.
    float l = clamp((line - line_low) * line_density, 0.0, float(line_lut.entry.length() - 1));
    int j = clamp(int(l), 0, line_lut.entry.length() - 2);
    float share = mix(line_lut.entry[j], line_lut.entry[j + 1], l - float(j));
#else
    const float share = 0.0;
#endif
#ifdef UNEVEN
    // Bracketing: positions rise from slice to slice for every line, and the even guess is rarely more than one off.
    int slices = slice_table.entry.length();
    int s = clamp(int(k), 0, slices - 2);
    while (s > 0 && slice_table.entry[s].x + slice_table.entry[s].y * share > k) --s;
    while (s + 2 < slices && slice_table.entry[s + 1].x + slice_table.entry[s + 1].y * share <= k) ++s;
    float here = slice_table.entry[s].x + slice_table.entry[s].y * share;
    float next = slice_table.entry[s + 1].x + slice_table.entry[s + 1].y * share;
    k = float(s) + (k - here) / (next - here);
    float final_slice = float(slices - 1);
#else
    k -= advance * share;
    float final_slice = float(textureSize(volume, 0).z - 1);
#endif
    // An index that is off by rounding at the outermost frame is still inside.
    inside = inside && k >= -1e-4 && k <= final_slice + 1e-4;
#endif
    texel = vec3((vec2(x, y) - grid_origin) * grid_density, k);
    return inside;
}

float fetch(ivec3 at) { return texelFetch(volume, at, 0).x; }

// The volume at texture indices, windowed to 0..1; beyond the border the nearest texel.
float sample_volume(vec3 texel) {
    float value;
    ivec3 size = textureSize(volume, 0);
    if (SAMPLING == 1) {
        vec3 at = clamp(texel, vec3(0.0), vec3(size - 1));
        ivec3 low = ivec3(at), high = min(low + 1, size - 1);
        vec3 w = at - vec3(low);
        vec4 near = vec4(fetch(low), fetch(ivec3(high.x, low.yz)), fetch(ivec3(low.x, high.y, low.z)), fetch(ivec3(high.xy, low.z)));
        vec4 far = vec4(fetch(ivec3(low.xy, high.z)), fetch(ivec3(high.x, low.y, high.z)), fetch(ivec3(low.x, high.yz)), fetch(high));
        vec4 plane = mix(near, far, w.z);
        vec2 row = mix(plane.xz, plane.yw, w.x);
        value = mix(row.x, row.y, w.y);
    } else {
        value = textureLod(volume, (texel + 0.5) / vec3(size), 0.0).x;
    }
    return clamp((value - window_low) * window_scale, 0.0, 1.0);
}
