// Exact medians of the hits in the windows of four vertically adjacent pixels. Eight thresholds at a time are counted over the
// rows that the windows share, each for all four windows. The thresholds converge to the ranks, and once at most three values
// are between a threshold and the rank, a last pass keeps the four least values above it. Only counts are stored, at any window
// size. The including shader declares RADIUS and `float tap(ivec2, ivec2)`.
//
// Invocations of a subgroup go through the same rounds until none needs another: they would wait for each other anyway, and where they
// leave a loop one by one, some drivers keep its variables twice.
#extension GL_KHR_shader_subgroup_vote : require
const vec4 PLACE = vec4(0.0, 1.0, 2.0, 3.0);
const int ROUNDS = 6;
// Taps of a row that are read at a time. All 15 at once take 104 registers on NVIDIA's Ada, which then holds 16 of 48 warps; one at a time 72,
// but half as long again on a CPU.
const int CHUNK = 5;
// The tap of a row, and a miss behind its end, which no count notices.
#define ROW_TAP(x, y) ((x) <= RADIUS ? tap(at + ivec2(x, y), last) : MISS)

uvec4 ones(bvec4 which, uint one) { return mix(uvec4(0u), uvec4(one), which); }
bvec4 both(bvec4 a, bvec4 b) { return bvec4(ivec4(a) & ivec4(b)); }
// The windows that contain a row, counted from the uppermost pixel's.
bvec4 holding(int row) { return lessThanEqual(abs(float(row) - PLACE), vec4(RADIUS)); }

// Two counts in a word halve the registers that the counts take: a window has less than 2^16 values.
struct Counts {
    uvec4 below[4]; // values below threshold i, by window; below threshold 4 + i from bit 16 on
    vec4 hits, least, most;
};
vec4 below(Counts c, int threshold) {
    uvec4 packed = c.below[threshold & 3];
    return vec4(threshold < 4 ? packed & 0xffffu : packed >> 16);
}

Counts counted(ivec2 at, ivec2 last, vec4 a, vec4 b, bool first) {
    Counts c = Counts(uvec4[4](uvec4(0u), uvec4(0u), uvec4(0u), uvec4(0u)), vec4(0.0), vec4(MISS), vec4(-MISS));
    [[dont_unroll]] for (int y = -RADIUS; y < RADIUS + 4; ++y) {
        uvec4 row = uvec4(0u);
        float hits = 0.0, least = MISS, most = -MISS;
        [[dont_unroll]] for (int from = -RADIUS; from <= RADIUS; from += CHUNK) [[unroll]] for (int n = 0; n < CHUNK; ++n) {
            float value = ROW_TAP(from + n, y);
            row += ones(lessThan(vec4(value), a), 1u) + ones(lessThan(vec4(value), b), 1u << 16);
            if (first) {
                hits += is_hit(value) ? 1.0 : 0.0;
                least = min(least, value);
                most = max(most, is_hit(value) ? value : -MISS);
            }
        }
        bvec4 inside = holding(y);
        for (int i = 0; i < 4; ++i) c.below[i] += ones(inside, row[i]);
        if (first) {
            c.hits += mix(vec4(0.0), vec4(hits), inside);
            c.least = mix(c.least, min(c.least, vec4(least)), inside);
            c.most = mix(c.most, max(c.most, vec4(most)), inside);
        }
    }
    return c;
}

// For values that repeat so often that no threshold comes within three of the rank: narrows the range (after Torben Mogensen's
// method). Every round ends on values of the window. The guess interpolates by rank, as for uniformly spread values; every other
// round halves the range, so that a cliff costs no more than a logarithm.
float narrowed(ivec2 at, ivec2 last, float rank, float low, float high, float under_low, float within) {
    float found = low;
    bool halve = false;
    while (low < high) {
        float share = halve ? 0.5 : clamp((rank - under_low + 0.5) / within, 0.0, 1.0);
        halve = !halve;
        // Clamped: the smallest numbers may be flushed to zero, and then no round would end on a value of the window.
        float guess = clamp(mix(low, high, share), low, high);
        float below = 0.0, equal = 0.0, under = low, over = high;
        [[dont_unroll]] for (int y = -RADIUS; y <= RADIUS; ++y) {
            [[dont_unroll]] for (int x = -RADIUS; x <= RADIUS; ++x) {
                float value = tap(at + ivec2(x, y), last);
                if (value < guess) {
                    below += 1.0;
                    under = max(under, value);
                } else if (value == guess) {
                    equal += 1.0;
                } else {
                    over = min(over, value);
                }
            }
        }
        if (rank < below) {
            high = under;
            found = under;
            within = below - under_low;
        } else if (rank < below + equal) {
            low = guess;
            high = guess;
            found = guess;
        } else {
            low = over;
            found = over;
            within -= below + equal - under_low;
            under_low = below + equal;
        }
    }
    return found;
}

vec4 medians(ivec2 at, ivec2 last) {
    // The first thresholds are values of the window around its middle.
    vec4 a, b;
    for (int i = 0; i < 4; ++i) {
        vec2 inner = float(RADIUS) * vec2(0.1, 0.3), outer = float(RADIUS) * vec2(0.65, -0.25);
        mat2 rotation = i == 0 ? mat2(1, 0, 0, 1) : i == 1 ? mat2(0, 1, -1, 0) : i == 2 ? mat2(-1, 0, 0, -1) : mat2(0, -1, 1, 0);
        a[i] = tap(at + ivec2(0, 1) + ivec2(round(rotation * inner)), last);
        b[i] = tap(at + ivec2(0, 1) + ivec2(round(rotation * outer)), last);
    }
    Counts c = counted(at, last, a, b, true);
    bvec4 surface = greaterThan(2.0 * c.hits, vec4((2 * RADIUS + 1) * (2 * RADIUS + 1)));
    if (!subgroupAny(any(surface))) return vec4(MISS);
    // The value of rank `rank` is from low to high; `under` values are below low, `upto` values are not above high.
    vec4 low = c.least, high = c.most, under = vec4(0.0), upto = c.hits, rank = floor((c.hits - 1.0) * 0.5);
    for (int round = 0; round < ROUNDS; ++round) {
        for (int i = 0; i < 8; ++i) {
            vec4 t = vec4(i < 4 ? a[i & 3] : b[i & 3]);
            vec4 count = below(c, i);
            bvec4 is_under = lessThanEqual(count, rank);
            bvec4 raise = both(is_under, greaterThan(t, low)), lower = both(not(is_under), lessThan(t, high));
            low = mix(low, t, raise);
            under = mix(under, count, raise);
            high = mix(high, t, lower);
            upto = mix(upto, count, lower);
        }
        vec4 above = rank - under, within = max(upto - under, vec4(1.0));
        if (!subgroupAny(any(both(surface, both(greaterThan(above, vec4(3.0)), lessThan(low, high)))))) break;
        // The position of the rank for uniformly spread values, minus a margin so that the last pass starts from below.
        vec4 margin = 0.25 * sqrt(within);
        a = mix(low, high, clamp((above - 1.0 - margin) / within, 0.0, 1.0));
        b = mix(low, high, clamp((above - 1.0 + margin) / within, 0.0, 1.0));
        c = counted(at, last, a, b, false);
    }
    // The four least values from low on, in order.
    vec4 v0 = vec4(MISS), v1 = v0, v2 = v0, v3 = v0;
    [[dont_unroll]] for (int y = -RADIUS; y < RADIUS + 4; ++y) {
        vec4 least = mix(vec4(MISS), low, holding(y));
        [[dont_unroll]] for (int from = -RADIUS; from <= RADIUS; from += CHUNK) [[unroll]] for (int n = 0; n < CHUNK; ++n) {
            float value = ROW_TAP(from + n, y);
            vec4 v = mix(vec4(MISS), vec4(value), greaterThanEqual(vec4(value), least));
            v3 = min(v3, max(v2, v));
            v2 = min(v2, max(v1, v));
            v1 = min(v1, max(v0, v));
            v0 = min(v0, v);
        }
    }
    vec4 above = rank - under;
    vec4 found = mix(mix(v0, v1, greaterThan(above, vec4(0.0))), mix(v2, v3, greaterThan(above, vec4(2.0))), greaterThan(above, vec4(1.0)));
    found = mix(vec4(MISS), found, surface);
    [[dont_unroll]] for (int i = 0; i < 4; ++i) {
        if (surface[i] && above[i] > 3.0) {
            found[i] = narrowed(at + ivec2(0, i), last, rank[i], low[i], high[i], under[i], upto[i] - under[i]);
        }
    }
    return found;
}
