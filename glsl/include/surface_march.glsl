// The march of the surface detector along a ray. A shader that also composites the samples of the march (`COMPOSITES`) takes
// part in it: each sample that both need is taken once.
//
// The shader that includes this file defines:
//   COMPOSITES       a constant: whether samples are composited
//   to_composite     the first sample that is still to be composited; NEVER if none is
//   take             takes sample i of the march: false if it is outside the insonified region. It composites sample `to_composite`.
//   skip_transparent skips samples that are transparent, from `to_composite` on
#extension GL_KHR_shader_subgroup_vote : require
#extension GL_EXT_control_flow_attributes : require
layout(constant_id = 6) const int BEHIND = 0; // samples averaged behind the surface

bool take(Ray ray, int i, inout Slices slices, out float value);
void skip_transparent(Ray ray);

// Samples of one search where no empty space is skipped.
const int MAX_SEARCH_SAMPLES = 64;

// A GPU runs as many rays at a time as their registers allow, and while the taps of the sliding filter are summed the march keeps its
// whole state. So it keeps no value that follows from others. Compilers do not compute again what they have computed before: where one
// shall, its terms differ.

// The pixel: its column, and its row from bit 16 on.
int packed_pixel = 0;
void keep_pixel(ivec2 pixel) { packed_pixel = pixel.x | pixel.y << 16; }
ivec2 kept_pixel(int i) {
    int packed = packed_pixel + int(i < -0x40000000); // no sample is as far in front of the camera, which a compiler cannot know
    return ivec2(packed & 0xffff, packed >> 16);
}

Ray aimed(Ray ray, int i) {
    if (SLIDING > 0) aim(ray, vec2(kept_pixel(i)) + 0.5);
    return ray;
}

// What `take` returns. Where a sample has taps, its value alone is kept: OUTSIDE, or 0 and more.
const float OUTSIDE = -1.0;
bool taken(bool inside, float value) { return SLIDING > 0 ? value > OUTSIDE : inside; }

// i + 1/2 without the number i, which compositing needs later.
vec3 place_of(Ray ray, int i) { return place_at(aimed(ray, i), offset_of(ray, SLIDING > 0 ? float(2 * i + 1) * SAMPLE_AT : float(i) + SAMPLE_AT)); }

// Number of complete steps on a ray, and on this one.
int complete_steps(Ray ray) { return ray.leave > ray.enter ? int(steps_to(ray, ray.leave - ray.enter)) : 0; }
int complete = 0;

// The detector may use some samples behind the last complete step.
const int BEYOND = HALF * ROUGH + RING;
bool is_in_reach(int i) { return i - BEYOND < complete; }

// The initial search: no edge is known.
bool searches() { return state == START && !looks_again() && !is_after_speck(); }

// Where D rises above FOLLOW_LEVEL of the peak for the last time before it, samples; NEVER if the ring is not full that early.
float risen_at(Ray ray, inout Slices slices) {
    float level = FOLLOW_LEVEL * best, at = float(NEVER), last = 0.0;
    filled = 0;
    for (int i = max(fine_from, fired - 2 * RING); i <= best_at; ++i) {
        vec3 texel;
        locate(place_of(ray, i), texel);
        float difference = push_sample(sample_along(ray, i, SAMPLE_AT, texel, slices));
        if (filled > RING && last <= level && difference > level) at = float(i) - (difference - level) / (difference - last);
        last = difference;
    }
    return at;
}

// Distance of the surface along the ray, mm, or MISS. `echo`: the echo at the surface, 1 where one was found, the mean echo behind it.
float find_surface(Ray ray, inout Slices slices, out vec3 echo) {
    complete = complete_steps(ray);
    // The region limits where surfaces may be, not which samples the detector uses: its ring is filled in front of the region,
    // and an edge that begins inside may peak behind it. Samples behind the camera are not used.
    int first = max(-HALF * ROUGH, int(ceil(steps_to(ray, -ray.enter) - 0.5)));

    segment = fine_from = first;
    // A subgroup marches until its last ray is done: rays that are would wait anyway. Where rays leave a loop one by one, some drivers
    // keep its variables twice, and this loop carries the whole state.
    int i = complete > 0 ? first : NEVER; // NEVER: the detector is done
    do {
        if (SKIP == 1) {
            for (bool skips = state == START && !looks_again() && is_in_reach(i); skips;) {
                RaySegment here = segment_at(aimed(ray, i), i, SAMPLE_AT);
                skips = here.kind == EMPTY;
                if (skips) {
                    // The same as if each sample were outside.
                    i += (here.stop - i + ROUGH - 1) / ROUGH * ROUGH;
                    restart(i);
                    skips = is_in_reach(i);
                } else if (here.kind == HOMOGENEOUS && DETECTOR == 0 && filled >= RING && is_quiet()) {
                    // Refill the ring with the last samples of the segment, so that it holds what it would hold without skipping.
                    int end = complete + BEYOND, stop = min(here.stop, end);
                    int steps = (stop - i + ROUGH - 1) / ROUGH, left = stop == end ? 0 : RING;
                    if (steps > left) {
                        i += (steps - left) * ROUGH;
                        filled = 0;
                    }
                }
            }
            if (COMPOSITES) skip_transparent(ray);
        }
        // The initial search has its own loop: on a device that runs rays under masks, each sample would otherwise pay for all states.
        // The sample that ends it stays in the ring for the second loop. Samples between those of the detector, and those behind the
        // surface, are only composited: in the same loop, so that rays in different states take their samples together.
        int n = SKIP == 1 ? SAMPLES_PER_LOOKUP : MAX_SEARCH_SAMPLES;
        bool waits = false;
        float difference = 0.0, noise_bar = 0.0;
        bool searching = is_in_reach(i) && searches();
        for (; n > 0 && (searching ? is_in_reach(i) : COMPOSITES && i == NEVER && to_composite < NEVER); --n) {
            int at = COMPOSITES ? (searching ? min(i, to_composite) : to_composite) : i;
            float value;
            bool inside = take(ray, at, slices, value);
            if (COMPOSITES && !(searching && at == i)) continue;
            if (inside) {
                difference = push_sample(value);
                noise_bar = noise_bar_at(i, difference);
                if (is_event(difference, noise_bar)) {
                    waits = true;
                    searching = false;
                } else {
                    previous = difference;
                    i += ROUGH;
                }
            } else {
                i += ROUGH;
                restart(i);
            }
        }
        bool follows = waits || (!searches() && n > 0 && is_in_reach(i));
        for (; follows; --n, follows = !searches() && n > 0 && is_in_reach(i)) {
            float value = 0.0;
            if (waits || take(ray, i, slices, value)) {
                if (!waits) {
                    difference = push_sample(value);
                    noise_bar = noise_bar_at(i, difference);
                }
                waits = false;
                step_detector(difference, noise_bar, i);
            } else {
                skip_sample(i);
            }
        }
        if (i < NEVER && !is_in_reach(i) && !look_again(i)) i = NEVER;
    } while (subgroupAny(i < NEVER || (COMPOSITES && to_composite < NEVER)));
    // The ray ended during the second look: nothing confirms that the echo lasts.
    if (looks_again() && surfaces_passed < NUMBER) found = false;
    float distance = MISS;
    float behind = 0.0;
    bool is_surface = is_found() && (NUMBER == 1 || surfaces_passed + 1 >= NUMBER);
    if (is_surface) {
        float at = offset_of(ray, surface_place(PLACE == 2 ? risen_at(ray, slices) : 0.0) + SAMPLE_AT);
        is_surface = at >= 0.0 && at <= ray.leave - ray.enter;
        if (is_surface) {
            distance = ray.enter + at;
            // Once a ray: unrolled it would be a third of the shader.
            [[dont_unroll]] for (int i = 1; i <= BEHIND; ++i) {
                vec3 texel;
                if (locate(ray.origin + ray.direction * (distance + float(i) * behind_step), texel)) behind += sample_volume(texel);
            }
            behind /= float(max(BEHIND, 1));
        }
    }
    echo = vec3(is_surface ? (PLACE > 0 ? top : first_echo) : 0.0, is_surface ? 1.0 : 0.0, behind);
    return distance;
}
