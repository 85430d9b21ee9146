// Median of a square window; beyond the border the nearest pixel stands in. Of distances: hits and misses vote, and where
// hits win, the (lower) median of the hits, so that a pinhole is closed and no rim is drawn towards a miss.
// variants: plane; slice SLICE; distance DISTANCE
#version 460
layout(constant_id = 0) const int RADIUS = 1;
#extension GL_EXT_scalar_block_layout : require
layout(scalar) uniform Params {
#include "slice_params.glsl"
};
#include "filter.glsl"

void main() {
    ivec3 at = made_texel();
    ivec3 size = source_size();
    if (any(greaterThanEqual(at, size))) return;
    ivec2 last = size.xy - 1;

    float low = MISS, high = -MISS;
    int valid = 0;
    for (int y = -RADIUS; y <= RADIUS; ++y) {
        for (int x = -RADIUS; x <= RADIUS; ++x) {
            float value = read_at(ivec3(clamp(at.xy + ivec2(x, y), ivec2(0), last), at.z));
            if (!VALID(value)) continue;
            low = min(low, value);
            high = max(high, value);
            ++valid;
        }
    }
    int window = (2 * RADIUS + 1) * (2 * RADIUS + 1);
    if (2 * valid <= window) {
        write_at(at, MISS);
        return;
    }
    // Selection by narrowing the value range (after Torben Mogensen's method): every round ends on values that are there, so
    // the result is exact, and no window has to be held in registers. The guess goes by rank, as if values lay evenly, which
    // on a smooth surface they do; every other round halves the range, so that a cliff costs no more than a logarithm.
    int rank = (valid - 1) / 2;
    int under_low = 0, within = valid; // values below `low`, and from `low` to `high`
    float found = low;
    bool halve = false;
    while (low < high) {
        float share = halve ? 0.5 : (float(rank - under_low) + 0.5) / float(within);
        halve = !halve;
        // Clamped: the smallest numbers may be flushed to zero, and then no round would end on a value that is there.
        float guess = clamp(low + share * (high - low), low, high);
        int below = 0, equal = 0;
        float under = low, over = high;
        for (int y = -RADIUS; y <= RADIUS; ++y) {
            for (int x = -RADIUS; x <= RADIUS; ++x) {
                float value = read_at(ivec3(clamp(at.xy + ivec2(x, y), ivec2(0), last), at.z));
                if (!VALID(value)) continue;
                if (value < guess) {
                    ++below;
                    under = max(under, value);
                } else if (value == guess) {
                    ++equal;
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
    write_at(at, found);
}
