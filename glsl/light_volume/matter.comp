// What each cell of the light volume holds: the density of its matter, of 1 where the transfer function is most opaque, and the echo, whose
// slope is that of the tissue's surface.
#version 460
#include "common.glsl"
layout(constant_id = 29) const int ENTRIES = 256; // of the transfer table
layout(constant_id = 35) const int TAPS = 1;      // samples along each edge of a cell
layout(scalar) uniform Params {
#include "ray_params.glsl"
    vec3 light_low; // corner of the first cell, mm
    float cell;     // edge of a cell, mm
    float density;  // of an absorption of 1
};
#include "ray.glsl"
#include "kept.glsl"
readonly buffer TransferTable { vec4 entry[]; } transfer;
uniform writeonly image3D matter;

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, imageSize(matter)))) return;
    float dense = 0.0, echo = 0.0;
    for (int n = 0; n < TAPS * TAPS * TAPS; ++n) {
        ivec3 tap = ivec3(n % TAPS, (n / TAPS) % TAPS, n / (TAPS * TAPS));
        // Cells beyond the box hold what is at its faces, as all that reads the lattice repeats the outermost cell: a face of the region is no surface, and no light
        // comes in through it, however many cells fit.
        vec3 p = clamp(light_low + (vec3(at) + (vec3(tap) + 0.5) / float(TAPS)) * cell, box_low, box_high);
        vec3 texel;
        // What is beyond the first and the last slice casts shadows as they do: a cut has no bright face.
        vec4 place;
        bool insonified = locate(p, texel, place);
        if (SWEEP > 0) {
            Sector limits = sector();
            insonified = all(greaterThanEqual(place.xy, limits.low.xy)) && all(lessThanEqual(place.xy, limits.high.xy));
        }
        if (!insonified || !is_kept(p)) continue;
        float value = raw_volume(texel);
        float e = windowed(value) * float(ENTRIES - 1);
        int low = min(int(e), ENTRIES - 2);
        dense += mix(transfer.entry[low].a, transfer.entry[low + 1].a, e - float(low));
        echo += value;
    }
    float share = 1.0 / float(TAPS * TAPS * TAPS);
    imageStore(matter, at, vec4(min(density * dense * share, 1.0), echo * share, 0.0, 0.0));
}
