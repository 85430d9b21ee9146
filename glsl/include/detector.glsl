// The surface detector, one sample of a ray after the other. D is the mean of the newer half of the last RING samples minus
// the mean of the older half. A rough detector with longer steps rides over specks; where it fires, the ray steps back and a
// fine one finds the place. The adaptive detector asks that an edge stand out from the noise before it; what does not is
// looked at again when the ray has nothing better.
layout(constant_id = 3) const int ROUGH = 2; // fine steps in a rough one; 1: no rough detector
layout(constant_id = 4) const int PEAK = 1;   // 0: the first crossing is the place
layout(constant_id = 5) const int NUMBER = 1; // which surface of the ray
layout(constant_id = 7) const int DETECTOR = 0; // 0 threshold, 1 adaptive, 2 adaptive and passes specks

const int RING = 8;
const int MEMORY = 16; // samples that the noise is learnt from
const int SEARCH_ROUGH = 0, SEARCH_FINE = 1, FOLLOW = 2;
const int START = ROUGH > 1 ? SEARCH_ROUGH : SEARCH_FINE;
const int NEVER = 0x7fffffff;
const vec4 QUARTER = vec4(0.25);

int state = START;
int stride = ROUGH;
int limit = NEVER; // the fine search gives up here
int segment = 0;   // first sample since the ray entered the insonified region
int filled = 0;
int fired = 0;
int seen = 0; // surfaces left behind
bool found = false;
vec4 older = vec4(0.0), newer = vec4(0.0);
float previous = 0.0;
// The largest difference since the crossing, its neighbours, its sample and the echo behind it. Until the sample after it
// is known it may not be the largest, and there is no surface.
float best = 0.0, before = 0.0, after = 0.0, top = 0.0;
int best_at = 0;
float first_echo = 0.0; // behind the crossing
// What lies before the edge: samples learnt, their mean and variance.
float learnt = 0.0, quiet = 0.0, variance = 0.0;
// The tallest edge that was passed over, and the level that the echo behind it must exceed.
float weak = 0.0, weak_level = 0.0;
int weak_at = 0, weak_segment = 0;
bool again = false; // it is being looked at
bool lasts = true;
bool anew = false; // behind a speck: the next edge need not have risen just now

float variance_of(vec4 samples) {
    vec4 off = samples - dot(samples, QUARTER);
    return dot(off, off) / 3.0;
}

// Running mean and sample variance of what has left the newer half, with a memory of MEMORY samples.
void learn() {
    if (learnt == 0.0) {
        quiet = dot(older, QUARTER);
        variance = variance_of(older);
        learnt = 4.0;
        return;
    }
    float off = older.w - quiet;
    learnt += 1.0;
    float n = min(learnt, float(MEMORY));
    quiet += off / n;
    variance += (off * off * (1.0 - 1.0 / n) - variance) / (n - 1.0);
}

// Starts anew at sample i: behind a gap, or for the next surface.
void restart(int i) {
    filled = 0;
    state = START;
    stride = ROUGH;
    limit = NEVER;
    segment = i;
    learnt = 0.0;
    variance = 0.0;
}

// The sample at i lies outside the insonified region. False: the ray is done.
bool skip_sample(inout int i) {
    if (state == FOLLOW || again) return false;
    i += ROUGH;
    restart(i);
    return true;
}

// The ring with another sample, and the difference then.
float push_sample(float value) {
    older = vec4(older.yzw, newer.x);
    newer = vec4(newer.yzw, value);
    ++filled;
    return polarity * dot(newer - older, QUARTER);
}

// What an edge must exceed to stand out, once the sample at i is in the ring. Few samples say less of the noise than many; while
// there are none, the scatter within the newer half stands for it.
float doubt_at(int i, float difference) {
    float doubt = 0.0;
    if (DETECTOR > 0 && !again) {
        bool ready = filled >= RING;
        bool searches = ready && state == START;
        // Before a Cartesian region lies the repeated border: that it is even says nothing.
        if (searches && (SWEEP > 0 || i >= (RING - 1) * stride)) learn();
        bool knows = SWEEP > 0 || learnt > 0.0;
        float deviation = noise * sqrt(knows ? variance : variance_of(newer));
        doubt = deviation * (knows ? 1.0 + float(RING) / max(learnt, 1.0) : 1.0);
        float height = START == SEARCH_ROUGH ? rough_threshold : threshold;
        if (searches && difference > max(height, weak) && i >= RING / 2) {
            weak = difference;
            weak_at = i;
            weak_segment = segment;
            weak_level = polarity * (knows ? quiet : dot(older, QUARTER)) + 0.5 * deviation;
        }
    }
    return doubt;
}

// Whether a difference may end the search that a ray begins with; whatever does not is only remembered.
bool is_event(float difference, float doubt) {
    return filled >= RING && difference > max(START == SEARCH_ROUGH ? rough_threshold : threshold, doubt);
}

// What the ring says at the sample i that is the last in it; moves i to the next one wanted. False: the ray is done.
bool judge(float difference, float doubt, inout int i) {
    bool ready = filled >= RING;
    if (ROUGH > 1 && state == SEARCH_ROUGH) {
        if (ready && difference > max(rough_threshold, doubt)) {
            limit = i + RING;
            // A ring that was silent a sample ago has the edge in its newer half; a fresh one may have it anywhere.
            int back = filled > RING ? RING / 2 * ROUGH + RING : RING * ROUGH;
            i = max(i - back, segment);
            state = SEARCH_FINE;
            stride = 1;
            filled = 0;
            return true;
        }
    } else if (state == SEARCH_FINE) {
        float bar = max(threshold, doubt);
        // A crossing: an edge that was there before the region began is not one.
        if (ready && i >= RING / 2 && difference > bar && (filled == RING || anew || previous <= bar)) {
            state = FOLLOW;
            fired = i;
            best = difference;
            best_at = i;
            before = filled > RING ? previous : difference;
            top = dot(newer, QUARTER);
            first_echo = top;
            found = PEAK == 0;
            lasts = true;
            if (PEAK == 0 && seen + 1 == NUMBER && !(DETECTOR == 2 || again)) return false;
        } else if (again && i >= limit) {
            return false;
        } else if (ROUGH > 1 && i >= limit) {
            // A false alarm: the rough ring is refilled so that its next word is about what the fine one has not seen.
            state = SEARCH_ROUGH;
            stride = ROUGH;
            filled = 0;
            i = limit - (RING - 2) * ROUGH;
            segment = i;
            return true;
        }
        anew = false;
    } else {
        if (i == best_at + 1) {
            after = difference;
            found = true;
        }
        // Half a ring behind the edge as much as half of the echo is still there, or it is a speck.
        if (DETECTOR == 2 && i == best_at + RING / 2) lasts = polarity * (dot(newer, QUARTER) - top) + 0.5 * best > 0.0;
        if (i >= fired + RING && (DETECTOR < 2 || again || i >= best_at + RING / 2)) {
            if (again) {
                // The mean echo behind an edge that did not stand out must.
                found = found && polarity * dot(newer + older, QUARTER) > 2.0 * weak_level;
                ++seen;
                return false;
            }
            if (DETECTOR == 2 && !lasts) {
                if (best > weak) {
                    weak = best;
                    weak_at = best_at;
                    weak_segment = segment;
                    weak_level = -1.0e9;
                }
                // Fine steps for a while: a rough ring would be filled only behind a wall that follows the speck.
                state = SEARCH_FINE;
                limit = ROUGH > 1 ? i + RING * ROUGH : NEVER;
                found = false;
                anew = true;
                previous = difference;
                i += stride;
                return true;
            }
            if (++seen == NUMBER) return false;
            // The next surface is looked for from here.
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

// The ray is at its end: whether the tallest edge that it passed over shall be looked at again, from i.
bool look_again(inout int i) {
    if (DETECTOR == 0 || again || weak == 0.0 || seen + 1 != NUMBER || (state == FOLLOW && found)) return false;
    again = true;
    found = false;
    i = max(weak_at - RING * ROUGH, weak_segment);
    segment = i;
    state = SEARCH_FINE;
    stride = 1;
    filled = 0;
    limit = weak_at + RING;
    return true;
}

// Place of the surface found, in samples.
float surface_place() {
    if (PEAK == 0) return float(fired);
    // The edge lies in the middle of the ring where the difference peaks; a parabola through the neighbours refines.
    float bend = before - 2.0 * best + after;
    // Two equal differences put it in the middle between them, whichever came out larger by rounding.
    float shift = bend < 0.0 ? clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0.0;
    return float(best_at) + shift - 0.5 * float(RING - 1);
}
