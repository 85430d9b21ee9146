// Exact medians of the hits in the windows of four vertically adjacent pixels. Eight thresholds at a time are counted over the
// rows that the windows share, each for all four windows. The thresholds converge to the ranks, and once at most three values
// are between a threshold and the rank, a last pass keeps the four least values above it. Only counts are stored, at any window
// size. The including shader declares RADIUS, at most 31, and `float tap(ivec2, ivec2)`.
//
// Invocations of a subgroup go through the same rounds until none needs another: they would wait for each other anyway, and where they
// leave a loop one by one, some drivers keep its variables twice.
#extension GL_KHR_shader_subgroup_vote : require
const vec4 PLACE = vec4(0.0, 1.0, 2.0, 3.0);
const int ROUNDS = 6;
// Taps of a row that are read at a time. All at once take more registers; one at a time takes half as long again on a CPU.
const int CHUNK = 5;
// The tap of a row, and a miss behind its end, which no count notices.
#define ROW_TAP(x, y) ((x) <= RADIUS ? tap(at + ivec2(x, y), last) : MISS)

bvec4 both(bvec4 a, bvec4 b) { return bvec4(ivec4(a) & ivec4(b)); }
// The windows that contain a row, counted from the uppermost pixel's.
bvec4 holding(int row) { return lessThanEqual(abs(float(row) - PLACE), vec4(RADIUS)); }

// Each window's value of rank `rank` is from low to high. `counts` has in its lower half how many values are below low, and in its upper half how
// many are not above high. A window without a median has both at MISS, and a rank that no count exceeds.
struct Search {
    vec4 low, high;
    uvec4 counts, rank;
};
vec4 under(Search s) { return vec4(s.counts & 0xffffu); }
vec4 upto(Search s) { return vec4(s.counts >> 16); }

// One in the byte of each threshold above a value: a row has less than 2^8 values.
uint bytes(float value, vec4 thresholds) {
    uvec4 one = mix(uvec4(0u), uvec4(1u, 1u << 8, 1u << 16, 1u << 24), lessThan(vec4(value), thresholds));
    return one.x + one.y + one.z + one.w;
}
// The first and third byte, and the second and fourth, of two words.
uvec4 spread(uvec2 row) { return uvec4(row & 0xff00ffu, (row >> 8) & 0xff00ffu); }

// Counts the values below thresholds, and narrows the searches. A window is the one above it without its first row and with one more: no more
// than the counts of one window and three rows are kept. Searches take turns in their first component, which a GPU has in a register. The first
// time the last threshold is MISS, so that it counts the hits.
void count(ivec2 at, ivec2 last, vec4 a, vec4 b, bool first, inout Search s) {
    uvec4 sum = uvec4(0u); // of thresholds a.xz, b.xz, a.yw, b.yw
    uvec2 row_0 = uvec2(0u), row_1 = row_0, row_2 = row_0;
    float least = MISS, most = -MISS;
    int y = -RADIUS;
    [[dont_unroll]] for (int window = 0; window < 4; ++window) {
        [[dont_unroll]] for (; y <= window + RADIUS; ++y) {
            uvec2 row = uvec2(0u);
            [[dont_unroll]] for (int from = -RADIUS; from <= RADIUS; from += CHUNK) [[unroll]] for (int n = 0; n < CHUNK; ++n) {
                float value = ROW_TAP(from + n, y);
                row += uvec2(bytes(value, a), bytes(value, b));
                if (first) {
                    least = min(least, value);
                    most = max(most, is_hit(value) ? value : -MISS);
                }
            }
            sum += spread(row);
            if (y < 3 - RADIUS) {
                row_0 = row_1;
                row_1 = row_2;
                row_2 = row;
            }
        }
        if (first) {
            // The rows so far bound the window's values.
            uint hits = sum.w >> 16;
            bool surface = int(2u * hits) > (2 * RADIUS + 1) * (2 * RADIUS + 1);
            s.low.x = surface ? least : MISS;
            s.high.x = surface ? most : MISS;
            s.counts.x = hits << 16;
            s.rank.x = surface ? (hits - 1u) / 2u : 0xffffu;
        }
        uint under = s.counts.x & 0xffffu, upto = s.counts.x >> 16;
        [[unroll]] for (int i = 0; i < 8; ++i) {
            float t = i < 4 ? a[i & 3] : b[i & 3];
            uint word = sum[(i & 1) * 2 + i / 4], count = (i & 2) != 0 ? word >> 16 : word & 0xffffu;
            bool is_under = count <= s.rank.x;
            s.low.x = max(s.low.x, is_under ? t : -MISS);
            under = max(under, is_under ? count : 0u);
            s.high.x = min(s.high.x, is_under ? MISS : t);
            upto = min(upto, is_under ? 0xffffu : count);
        }
        s.counts.x = under | upto << 16;
        s.low = s.low.yzwx;
        s.high = s.high.yzwx;
        s.counts = s.counts.yzwx;
        s.rank = s.rank.yzwx;
        sum -= spread(row_0);
        row_0 = row_1;
        row_1 = row_2;
    }
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
    b.w = MISS;
    Search s;
    count(at, last, a, b, true, s);
    if (!subgroupAny(any(lessThan(s.low, vec4(MISS))))) return vec4(MISS);
    for (int round = 1; round < ROUNDS; ++round) {
        vec4 above = vec4(s.rank) - under(s), within = max(upto(s) - under(s), vec4(1.0));
        if (!subgroupAny(any(both(greaterThan(above, vec4(3.0)), lessThan(s.low, s.high))))) break;
        // The position of the rank for uniformly spread values, minus a margin so that the last pass starts from below.
        vec4 margin = 0.25 * sqrt(within);
        a = mix(s.low, s.high, clamp((above - 1.0 - margin) / within, 0.0, 1.0));
        b = mix(s.low, s.high, clamp((above - 1.0 + margin) / within, 0.0, 1.0));
        count(at, last, a, b, false, s);
    }
    // A search that is still far from its rank ends on its value, which is then the least from there on.
    vec4 above = vec4(s.rank) - under(s);
    [[dont_unroll]] for (int i = 0; i < 4; ++i) {
        if (above[i] > 3.0) {
            s.low[i] = narrowed(at + ivec2(0, i), last, float(s.rank[i]), s.low[i], s.high[i], under(s)[i], (upto(s) - under(s))[i]);
            above[i] = 0.0;
        }
    }
    // The four least values from low on, in order.
    vec4 v0 = vec4(MISS), v1 = v0, v2 = v0, v3 = v0;
    [[dont_unroll]] for (int y = -RADIUS; y < RADIUS + 4; ++y) {
        vec4 least = mix(vec4(MISS), s.low, holding(y));
        [[dont_unroll]] for (int from = -RADIUS; from <= RADIUS; from += CHUNK) [[unroll]] for (int n = 0; n < CHUNK; ++n) {
            float value = ROW_TAP(from + n, y);
            vec4 v = mix(vec4(MISS), vec4(value), greaterThanEqual(vec4(value), least));
            v3 = min(v3, max(v2, v));
            v2 = min(v2, max(v1, v));
            v1 = min(v1, max(v0, v));
            v0 = min(v0, v);
        }
    }
    return mix(mix(v0, v1, greaterThan(above, vec4(0.0))), mix(v2, v3, greaterThan(above, vec4(2.0))), greaterThan(above, vec4(1.0)));
}
