// The surface detector: a state machine over the samples of a ray. D is the mean of the newer half of the last RING samples
// minus the mean of the older half. A rough detector with longer steps ignores specks; where it fires, the ray steps back and
// a fine detector finds the position. The adaptive detector requires that an edge exceed the noise in front of it; if the ray
// has no such edge, it examines its largest weaker edge again.
layout(constant_id = 3) const int ROUGH = 2; // fine steps in a rough step; 1: no rough detector
layout(constant_id = 4) const int PEAK = 1;   // 0: the surface is at the first crossing
layout(constant_id = 5) const int NUMBER = 1; // which surface of the ray to report
layout(constant_id = 7) const int DETECTOR = 0; // 0 threshold, 1 adaptive, 2 adaptive and ignores specks

const int RING = 8;
const int MEMORY = 16; // samples in the noise estimate
const int SEARCH_ROUGH = 0, SEARCH_FINE = 1, FOLLOW = 2;
const int START = ROUGH > 1 ? SEARCH_ROUGH : SEARCH_FINE;
const int NEVER = 0x7fffffff;
const vec4 QUARTER = vec4(0.25);

int state = START;
int stride = ROUGH;
int limit = NEVER; // the fine search ends here
int segment = 0;   // first sample since the ray entered the insonified region
int filled = 0;
int fired = 0;
int surfaces_passed = 0; // surfaces found so far
bool found = false;
vec4 older = vec4(0.0), newer = vec4(0.0);
float previous = 0.0;
// The largest difference since the crossing, the differences before and after it, its sample, and the echo behind it. Until the
// sample after it is known, it may not be the largest, and there is no surface.
float best = 0.0, before = 0.0, after = 0.0, top = 0.0;
int best_at = 0;
float first_echo = 0.0; // echo behind the crossing
// Noise in front of the edge: number of samples, their mean and variance.
float samples_learnt = 0.0, noise_mean = 0.0, noise_variance = 0.0;
// The largest edge that was rejected, and the level that the echo behind it must exceed.
float weak = 0.0, weak_level = 0.0;
int weak_at = 0, weak_segment = 0;
bool second_look = false; // the rejected edge is being examined again
bool lasts = true;
bool after_speck = false; // just after a speck: the next edge may already be above the bar

float variance_of(vec4 samples) {
    vec4 off = samples - dot(samples, QUARTER);
    return dot(off, off) / 3.0;
}

// Running mean and sample variance of the samples that left the newer half, over MEMORY samples.
void learn() {
    if (samples_learnt == 0.0) {
        noise_mean = dot(older, QUARTER);
        noise_variance = variance_of(older);
        samples_learnt = 4.0;
        return;
    }
    float off = older.w - noise_mean;
    samples_learnt += 1.0;
    float n = min(samples_learnt, float(MEMORY));
    noise_mean += off / n;
    noise_variance += (off * off * (1.0 - 1.0 / n) - noise_variance) / (n - 1.0);
}

// Resets the search at sample i: after a gap, or for the next surface.
void restart(int i) {
    filled = 0;
    state = START;
    stride = ROUGH;
    limit = NEVER;
    segment = i;
    samples_learnt = 0.0;
    noise_variance = 0.0;
}

// Handles a sample i outside the insonified region. False: the ray is done.
bool skip_sample(inout int i) {
    if (state == FOLLOW || second_look) return false;
    i += ROUGH;
    restart(i);
    return true;
}

// Adds a sample to the ring; returns the new difference.
float push_sample(float value) {
    older = vec4(older.yzw, newer.x);
    newer = vec4(newer.yzw, value);
    ++filled;
    return polarity * dot(newer - older, QUARTER);
}

// The bar that an edge must exceed because of noise, after sample i entered the ring. The bar is higher while few samples are
// known. Without any, the variance of the newer half is used.
float noise_bar_at(int i, float difference) {
    float noise_bar = 0.0;
    if (DETECTOR > 0 && !second_look) {
        bool ready = filled >= RING;
        bool searches = ready && state == START;
        // A Cartesian volume repeats its border in front of the region: its constant value is no estimate of the noise.
        if (searches && (SWEEP > 0 || i >= (RING - 1) * stride)) learn();
        bool has_statistics = SWEEP > 0 || samples_learnt > 0.0;
        float deviation = noise * sqrt(has_statistics ? noise_variance : variance_of(newer));
        noise_bar = deviation * (has_statistics ? 1.0 + float(RING) / max(samples_learnt, 1.0) : 1.0);
        float height = START == SEARCH_ROUGH ? rough_threshold : threshold;
        if (searches && difference > max(height, weak) && i >= RING / 2) {
            weak = difference;
            weak_at = i;
            weak_segment = segment;
            weak_level = polarity * (has_statistics ? noise_mean : dot(older, QUARTER)) + 0.5 * deviation;
        }
    }
    return noise_bar;
}

// True if a difference may end the initial search of a ray.
bool is_event(float difference, float noise_bar) {
    return filled >= RING && difference > max(START == SEARCH_ROUGH ? rough_threshold : threshold, noise_bar);
}

// One step of the state machine after sample i entered the ring; moves i to the next sample to take. False: the ray is done.
bool step_detector(float difference, float noise_bar, inout int i) {
    bool ready = filled >= RING;
    if (ROUGH > 1 && state == SEARCH_ROUGH) {
        if (ready && difference > max(rough_threshold, noise_bar)) {
            limit = i + RING;
            // If the ring did not fire one sample earlier, the edge is in its newer half; in a new ring it may be anywhere.
            int back = filled > RING ? RING / 2 * ROUGH + RING : RING * ROUGH;
            i = max(i - back, segment);
            state = SEARCH_FINE;
            stride = 1;
            filled = 0;
            return true;
        }
    } else if (state == SEARCH_FINE) {
        float bar = max(threshold, noise_bar);
        // A crossing. An edge that was already above the bar before the region began is none.
        if (ready && i >= RING / 2 && difference > bar && (filled == RING || after_speck || previous <= bar)) {
            state = FOLLOW;
            fired = i;
            best = difference;
            best_at = i;
            before = filled > RING ? previous : difference;
            top = dot(newer, QUARTER);
            first_echo = top;
            found = PEAK == 0;
            lasts = true;
            if (PEAK == 0 && surfaces_passed + 1 == NUMBER && !(DETECTOR == 2 || second_look)) return false;
        } else if (second_look && i >= limit) {
            return false;
        } else if (ROUGH > 1 && i >= limit) {
            // A false alarm: refill the rough ring so that it next covers samples that the fine search has not covered.
            state = SEARCH_ROUGH;
            stride = ROUGH;
            filled = 0;
            i = limit - (RING - 2) * ROUGH;
            segment = i;
            return true;
        }
        after_speck = false;
    } else {
        if (i == best_at + 1) {
            after = difference;
            found = true;
        }
        // Half a ring after the edge at least half of the echo must remain, otherwise it is a speck.
        if (DETECTOR == 2 && i == best_at + RING / 2) lasts = polarity * (dot(newer, QUARTER) - top) + 0.5 * best > 0.0;
        if (i >= fired + RING && (DETECTOR < 2 || second_look || i >= best_at + RING / 2)) {
            if (second_look) {
                // The mean echo behind a rejected edge must exceed its level.
                found = found && polarity * dot(newer + older, QUARTER) > 2.0 * weak_level;
                ++surfaces_passed;
                return false;
            }
            if (DETECTOR == 2 && !lasts) {
                if (best > weak) {
                    weak = best;
                    weak_at = best_at;
                    weak_segment = segment;
                    weak_level = -1.0e9;
                }
                // Continue with fine steps for a while: a rough ring would not be full before a wall that follows the speck.
                state = SEARCH_FINE;
                limit = ROUGH > 1 ? i + RING * ROUGH : NEVER;
                found = false;
                after_speck = true;
                previous = difference;
                i += stride;
                return true;
            }
            if (++surfaces_passed == NUMBER) return false;
            // Search for the next surface from here.
            restart(i);
            found = false;
            weak = 0.0;
            return true;
        }
        if (difference > best && i < fired + RING) {
            best = difference;
            best_at = i;
            before = previous;
            top = dot(newer, QUARTER);
            lasts = true;
            if (PEAK == 1) found = false;
        }
    }
    previous = difference;
    i += stride;
    return true;
}

// At the end of the ray: true if the largest rejected edge is to be examined again, from i.
bool look_again(inout int i) {
    if (DETECTOR == 0 || second_look || weak == 0.0 || surfaces_passed + 1 != NUMBER || (state == FOLLOW && found)) return false;
    second_look = true;
    found = false;
    i = max(weak_at - RING * ROUGH, weak_segment);
    segment = i;
    state = SEARCH_FINE;
    stride = 1;
    filled = 0;
    limit = weak_at + RING;
    return true;
}

// Position of the surface found, in samples.
float surface_place() {
    if (PEAK == 0) return float(fired);
    // The edge is in the middle of the ring where the difference is largest; a parabola through the neighbours refines it.
    float curvature = before - 2.0 * best + after;
    // Two equal differences put it in the middle between them, whichever rounding made larger.
    float shift = curvature < 0.0 ? clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0.0;
    return float(best_at) + shift - 0.5 * float(RING - 1);
}
