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

vec3 place_of(Ray ray, int i) { return place_at(ray, offset_of(ray, float(i) + SAMPLE_AT)); }

// Number of complete steps on the ray.
int complete_steps(Ray ray) { return ray.leave > ray.enter ? int(steps_to(ray, ray.leave - ray.enter)) : 0; }

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
    int count = complete_steps(ray);
    // The region limits where surfaces may be, not which samples the detector uses: its ring is filled in front of the region,
    // and an edge that begins inside may peak behind it. Samples behind the camera are not used.
    int first = max(-HALF * ROUGH, int(ceil(steps_to(ray, -ray.enter) - 0.5)));
    int end = count > 0 ? count + HALF * ROUGH + RING : first;

    segment = fine_from = first;
    // A subgroup marches until its last ray is done: rays that are would wait anyway. Where rays leave a loop one by one, some drivers
    // keep its variables twice, and this loop carries the whole state.
    int i = first;
    bool goes_on = first < end;
    do {
        if (SKIP == 1) {
            RaySegment here;
            bool may_skip = state == START && !looks_again() && goes_on;
            for (bool skips = true; skips;) {
                here = segment_at(ray, i, SAMPLE_AT);
                skips = may_skip && here.kind == EMPTY && i < end;
                if (skips) {
                    // The same as if each sample were outside.
                    i += (here.stop - i + ROUGH - 1) / ROUGH * ROUGH;
                    restart(i);
                }
            }
            if (here.kind == HOMOGENEOUS && DETECTOR == 0 && state == START && !looks_again() && goes_on && filled >= RING) {
                // Refill the ring with the last samples of the segment, so that it holds what it would hold without skipping.
                int stop = min(here.stop, end);
                int steps = (stop - i + stride_now() - 1) / stride_now(), left = stop == end ? 0 : RING;
                if (is_quiet() && steps > left) {
                    i += (steps - left) * stride_now();
                    filled = 0;
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
        bool searches = goes_on && state == START && !looks_again() && !is_after_speck();
        for (; n > 0 && (searches ? i < end : COMPOSITES && !goes_on && to_composite < NEVER); --n) {
            int at = COMPOSITES ? (searches ? min(i, to_composite) : to_composite) : i;
            float value;
            bool inside = take(ray, at, slices, value);
            if (COMPOSITES && !(searches && at == i)) continue;
            if (inside) {
                difference = push_sample(value);
                noise_bar = noise_bar_at(i, difference);
                if (is_event(difference, noise_bar)) {
                    waits = true;
                    searches = false;
                } else {
                    previous = difference;
                    i += stride_now();
                }
            } else {
                i += ROUGH;
                restart(i);
            }
        }
        bool follows = waits || ((state != START || looks_again() || is_after_speck()) && goes_on && n > 0 && i < end);
        for (; follows; --n, follows = (state != START || looks_again() || is_after_speck()) && goes_on && n > 0 && i < end) {
            float value = 0.0;
            if (waits || take(ray, i, slices, value)) {
                if (!waits) {
                    difference = push_sample(value);
                    noise_bar = noise_bar_at(i, difference);
                }
                waits = false;
                goes_on = step_detector(difference, noise_bar, i);
            } else {
                goes_on = skip_sample(i);
            }
        }
        if (goes_on && i >= end) goes_on = look_again(i);
    } while (subgroupAny(goes_on || (COMPOSITES && to_composite < NEVER)));
    // The ray ended during the second look: nothing confirms that the echo lasts.
    if (looks_again() && surfaces_passed < NUMBER) found = false;
    float distance = MISS;
    float behind = 0.0;
    if (found && (NUMBER == 1 || surfaces_passed + 1 >= NUMBER)) {
        float at = offset_of(ray, surface_place(PLACE == 2 ? risen_at(ray, slices) : 0.0) + SAMPLE_AT);
        found = at >= 0.0 && at <= ray.leave - ray.enter;
        if (found) {
            distance = ray.enter + at;
            // Once a ray: unrolled it would be a third of the shader.
            [[dont_unroll]] for (int i = 1; i <= BEHIND; ++i) {
                vec3 texel;
                if (locate(ray.origin + ray.direction * (distance + float(i) * behind_step), texel)) behind += sample_volume(texel);
            }
            behind /= float(max(BEHIND, 1));
        }
    } else {
        found = false;
    }
    echo = vec3(found ? (PLACE > 0 ? top : first_echo) : 0.0, found ? 1.0 : 0.0, behind);
    return distance;
}
