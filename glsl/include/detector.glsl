// The surface detector: a state machine over the samples of a ray. D is the mean of the newer half of the last RING samples
// minus the mean of the older half: each half is as long as the edge, in mm, at every step. A rough detector with longer steps
// ignores specks; where it fires, the ray steps back and a fine detector finds the position. The adaptive detector requires
// that an edge exceed the noise in front of it; if the ray has no such edge, it examines its largest weaker edge again.
layout(constant_id = 3) const int ROUGH = 2; // fine steps in a rough step; 1: no rough detector
layout(constant_id = 4) const int PLACE = 1;  // the surface is 0 at the first crossing, 1 at the peak, 2 in the middle of the edge
layout(constant_id = 5) const int NUMBER = 1; // which surface of the ray to report
layout(constant_id = 7) const int DETECTOR = 0; // 0 threshold, 1 adaptive, 2 adaptive and ignores specks
layout(constant_id = 24) const int HALF = 4;    // samples of half a ring, at least 4
layout(constant_id = 25) const int FOLLOW_LENGTH = 8; // samples after the crossing in which the peak may be

const int RING = 2 * HALF;
const int MEMORY = 2 * RING; // samples in the noise estimate
const float FOLLOW_LEVEL = 0.7; // an edge has been followed when D falls below this share of its largest value
const float UNIT = 4194304.0; // of a sample in a long ring
const int SEARCH_ROUGH = 0, SEARCH_FINE = 1, FOLLOW = 2, FOLLOWED = 3; // followed: the peak is known
const int START = ROUGH > 1 ? SEARCH_ROUGH : SEARCH_FINE;
const int NEVER = 0x7fffffff;
const vec4 QUARTER = vec4(0.25);

int state = START;
int limit = NEVER; // the fine search ends here; where an edge is not followed, the sample that crossed the bar
int segment = 0;   // first sample since the ray entered the insonified region
int filled = 0;
int fired = 0;
int surfaces_passed = 0; // surfaces found so far
bool found = false;
// A ring of 8 samples is in registers. A longer one is an array, with the sums of its halves. Those are integers, in units of
// 2^-22: they do not depend on the samples that have left the ring, and a ring that was refilled is the same ring.
vec4 older = vec4(0.0), newer = vec4(0.0);
int ring[RING];
int older_sum = 0, newer_sum = 0;
int quiet_samples = 0; // the last samples that cannot fire the detector
int leaving = 0; // the sample that went from the newer half to the older
float previous = 0.0;
// The largest difference since the crossing, the differences before and after it, its sample, and the echo behind it. Until the
// sample after it is known, it may not be the largest, and there is no surface.
float best = 0.0, before = 0.0, after = 0.0, top = 0.0;
int best_at = 0;
bool confirmed = false; // the echo behind a rejected edge lasts
// Place where D falls below FOLLOW_LEVEL of the peak, samples; NEVER where it did not. First sample that the ring may use.
float fallen_at = float(NEVER);
int fine_from = 0;
float first_echo = 0.0; // echo behind the crossing
// Noise in front of the edge: number of samples, their mean and variance.
float samples_learnt = 0.0, noise_mean = 0.0, noise_variance = 0.0;
// The largest edge that was rejected, and the level that the echo behind it must exceed.
float weak = 0.0, weak_level = 0.0;
int weak_at = 0, weak_segment = 0;
bool second_look = false; // the rejected edge is being examined again
bool lasts = true;
bool after_speck = false; // just after a speck: the next edge may already be above the bar

// What a setting fixes is a constant here: compilers do not see through a variable that the march carries, and it would take a register.
int stride_now() { return ROUGH > 1 && state == SEARCH_ROUGH ? ROUGH : 1; }
bool looks_again() { return DETECTOR > 0 && second_look; }
bool is_after_speck() { return DETECTOR == 2 && after_speck; }
// The edge that crosses the bar is followed: otherwise the ray ends there.
const bool FOLLOWS = PLACE > 0 || NUMBER > 1 || DETECTOR > 0;
bool is_found() { return FOLLOWS ? found : state == FOLLOW; }
// The next surface is the one to report.
bool is_wanted() { return NUMBER == 1 || surfaces_passed + 1 == NUMBER; }

float variance_of(vec4 samples) {
    vec4 off = samples - dot(samples, QUARTER);
    return dot(off, off) / 3.0;
}

// Of a half of a long ring; `away`: its newest sample, 0 the newest of all.
float variance_from(int away, int sum) {
    float mean = float(sum) / (UNIT * float(HALF)), squares = 0.0;
    for (int n = away; n < away + HALF; ++n) {
        float off = float(ring[(filled - 1 - n) % RING]) / UNIT - mean;
        squares += off * off;
    }
    return squares / float(HALF - 1);
}

float older_mean() { return HALF == 4 ? dot(older, QUARTER) : float(older_sum) / (UNIT * float(HALF)); }
float newer_mean() { return HALF == 4 ? dot(newer, QUARTER) : float(newer_sum) / (UNIT * float(HALF)); }
float older_variance() { return HALF == 4 ? variance_of(older) : variance_from(HALF, older_sum); }
float newer_variance() { return HALF == 4 ? variance_of(newer) : variance_from(0, newer_sum); }

// True if no sample of the ring can fire the detector. The next sample drops the oldest of eight, which need not be kept for that.
bool is_quiet() {
    vec4 most = max(older, newer);
    return HALF == 4 ? max(max(newer.x, most.y), max(most.z, most.w)) <= quiet_level : quiet_samples >= RING;
}

// Running mean and sample variance of the samples that left the newer half, over MEMORY samples.
void learn() {
    if (samples_learnt == 0.0) {
        noise_mean = older_mean();
        noise_variance = older_variance();
        samples_learnt = float(HALF);
    } else {
        float off = (HALF == 4 ? older.w : float(leaving) / UNIT) - noise_mean;
        samples_learnt += 1.0;
        float n = min(samples_learnt, float(MEMORY));
        noise_mean += off / n;
        noise_variance += (off * off * (1.0 - 1.0 / n) - noise_variance) / (n - 1.0);
    }
}

// Resets the search at sample i: after a gap, or for the next surface.
void restart(int i) {
    filled = 0;
    state = START;
    limit = NEVER;
    segment = i;
    fine_from = i;
    samples_learnt = 0.0;
    noise_variance = 0.0;
}

// Handles a sample i outside the insonified region; moves i to the next sample to take.
void skip_sample(inout int i) {
    if (state < FOLLOW && !looks_again()) {
        i += ROUGH;
        restart(i);
    } else {
        i = NEVER;
    }
}

// A difference by the sign that is looked for; of either, its size.
float judged(float difference) { return polarity == 0.0 ? abs(difference) : polarity * difference; }

// Adds a sample to the ring; returns the new difference.
float push_sample(float value) {
    if (HALF == 4) {
        older = vec4(older.yzw, newer.x);
        newer = vec4(newer.yzw, value);
        ++filled;
        return judged(dot(newer - older, QUARTER));
    }
    if (filled == 0) older_sum = newer_sum = quiet_samples = 0;
    int at = filled % RING;
    if (filled >= RING) older_sum -= ring[at];
    if (filled >= HALF) {
        leaving = ring[(filled - HALF) % RING];
        newer_sum -= leaving;
        older_sum += leaving;
    }
    int rounded = int(value * UNIT + 0.5);
    ring[at] = rounded;
    newer_sum += rounded;
    quiet_samples = value <= quiet_level ? quiet_samples + 1 : 0;
    ++filled;
    return judged(float(newer_sum - older_sum) / (UNIT * float(HALF)));
}

// The bar that an edge must exceed because of noise, after sample i entered the ring. The bar is higher while few samples are
// known. Without any, the variance of the newer half is used.
float noise_bar_at(int i, float difference) {
    float noise_bar = 0.0;
    if (DETECTOR > 0 && !second_look) {
        bool ready = filled >= RING;
        bool searches = ready && state == START;
        // A Cartesian volume repeats its border in front of the region: its constant value is no estimate of the noise.
        if (searches && (SWEEP > 0 || i >= (RING - 1) * stride_now())) learn();
        float height = START == SEARCH_ROUGH ? rough_threshold : threshold;
        // The bar is that of the noise only where the difference exceeds the other.
        if (difference > min(height, threshold)) {
            bool has_statistics = SWEEP > 0 || samples_learnt > 0.0;
            float deviation = noise * sqrt(has_statistics ? noise_variance : newer_variance());
            noise_bar = deviation * (has_statistics ? 1.0 + float(RING) / max(samples_learnt, 1.0) : 1.0);
            if (searches && difference > max(height, weak) && i >= HALF) {
                weak = difference;
                weak_at = i;
                weak_segment = segment;
                weak_level = polarity * (has_statistics ? noise_mean : older_mean()) + 0.5 * deviation;
            }
        }
    }
    return noise_bar;
}

// True if a difference may end the initial search of a ray.
bool is_event(float difference, float noise_bar) {
    return filled >= RING && difference > max(START == SEARCH_ROUGH ? rough_threshold : threshold, noise_bar);
}

// One step of the state machine after sample i entered the ring; moves i to the next sample to take, NEVER if the ray is done. It has
// one way out: an early return becomes a loop of one iteration, for which some drivers keep the state twice.
void step_detector(float difference, float noise_bar, inout int i) {
    bool ready = filled >= RING, goes_on = true;
    int next = i + stride_now();
    if (ROUGH > 1 && state == SEARCH_ROUGH) {
        if (ready && difference > max(rough_threshold, noise_bar)) {
            limit = i + RING;
            // If the ring did not fire one sample earlier, the edge is in its newer half; in a new ring it may be anywhere.
            int back = filled > RING ? HALF * ROUGH + RING : RING * ROUGH;
            next = max(i - back, segment);
            fine_from = next;
            state = SEARCH_FINE;
            filled = 0;
        }
    } else if (state == SEARCH_FINE) {
        float bar = max(threshold, noise_bar);
        // A crossing. An edge that was already above the bar before the region began is none.
        if (ready && i >= HALF && difference > bar && (filled == RING || is_after_speck() || previous <= bar)) {
            state = FOLLOW;
            if (FOLLOWS) fired = i;
            else limit = i;
            best = difference;
            best_at = i;
            before = filled > RING ? previous : difference;
            top = newer_mean();
            first_echo = top;
            if (FOLLOWS) found = PLACE == 0;
            lasts = true;
            confirmed = false;
            fallen_at = float(NEVER);
            goes_on = PLACE > 0 || !is_wanted() || DETECTOR == 2 || looks_again();
        } else if (looks_again() && i >= limit) {
            goes_on = false;
        } else if (ROUGH > 1 && i >= limit) {
            // A false alarm: refill the rough ring so that it next covers samples that the fine search has not covered.
            state = SEARCH_ROUGH;
            filled = 0;
            next = limit - (RING - 2) * ROUGH;
            segment = next;
            fine_from = next;
        }
        after_speck = false;
    } else if (FOLLOWS) {
        if (i == best_at + 1) {
            after = difference;
            found = true;
        }
        // Half a ring after the edge at least half of the echo must remain, otherwise it is a speck.
        if (DETECTOR == 2 && i == best_at + HALF) lasts = polarity * (newer_mean() - top) + 0.5 * best > 0.0;
        // The mean echo behind a rejected edge must exceed its level.
        if (i == fired + RING) confirmed = polarity * (newer_mean() + older_mean()) > 2.0 * weak_level;
        // Higher edges behind this one are others: its own difference does not fall far before it peaks.
        if (state == FOLLOW) {
            float level = FOLLOW_LEVEL * best;
            // In the second look a dip in front of the known peak is one of the noise.
            bool falls = difference < level && (!looks_again() || i >= weak_at);
            bool followed = falls || i >= (looks_again() ? max(fired + FOLLOW_LENGTH, weak_at + 2) : fired + FOLLOW_LENGTH);
            if (falls) fallen_at = float(i) - (level - difference) / max(previous - difference, level - difference);
            if (followed) {
                state = FOLLOWED;
            } else if (difference > best) {
                best = difference;
                best_at = i;
                before = previous;
                top = newer_mean();
                lasts = true;
                if (PLACE > 0) found = false;
            }
        }
        bool is_last = DETECTOR < 2 && !looks_again() && is_wanted();
        if (state == FOLLOWED && (is_last || i >= fired + RING) && (DETECTOR < 2 || looks_again() || i >= best_at + HALF)) {
            bool wanted = is_wanted();
            if (looks_again()) {
                found = found && confirmed;
                ++surfaces_passed;
                goes_on = false;
            } else if (DETECTOR == 2 && !lasts) {
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
            } else if (wanted) {
                ++surfaces_passed;
                goes_on = false;
            } else {
                ++surfaces_passed;
                // Search for the next surface from here.
                restart(i);
                found = false;
                weak = 0.0;
                next = i;
            }
        }
    }
    previous = difference;
    i = goes_on ? next : NEVER;
}

// At the end of the ray: true if the largest rejected edge is to be examined again, from i.
bool look_again(inout int i) {
    bool again = DETECTOR > 0 && !second_look && weak != 0.0 && is_wanted() && !(state >= FOLLOW && found);
    if (again) {
        second_look = true;
        found = false;
        i = max(weak_at - RING * ROUGH, weak_segment);
        segment = i;
        fine_from = i;
        state = SEARCH_FINE;
        filled = 0;
        limit = weak_at + RING;
    }
    return again;
}

// Position of the surface found, in samples. `risen_at`: where D rises above FOLLOW_LEVEL of the peak, or NEVER.
float surface_place(float risen_at) {
    if (PLACE == 0) return float(FOLLOWS ? fired : limit);
    // The edge is in the middle of the ring where the difference is largest.
    const float middle_of_ring = 0.5 * float(RING - 1);
    if (PLACE == 2 && max(risen_at, fallen_at) < float(NEVER)) return 0.5 * (risen_at + fallen_at) - middle_of_ring;
    // A parabola through the neighbours refines it.
    float curvature = before - 2.0 * best + after;
    // Two equal differences put it in the middle between them, whichever rounding made larger.
    float shift = curvature < 0.0 ? clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0.0;
    return float(best_at) + shift - middle_of_ring;
}
