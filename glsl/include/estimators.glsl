// Local estimators of a pixel from its neighbours (thesis 5.3.1). The including shader declares `constant ESTIMATOR`, the parameters
// `edge` and `least`, and `float level(ivec2)`: a pixel as one number. Beyond the border the nearest pixel repeats. Misses are
// ignored. `at` itself must not be a miss.
#include "conductance.glsl"

float level_near(ivec2 at, ivec2 last) { return level(clamp(at, ivec2(0), last)); }

// Of 3x3; of an even number, the lower.
float median_of(ivec2 at, ivec2 last) {
    float v[9];
    int hits = 0;
    for (int i = 0; i < 9; ++i) {
        v[i] = level_near(at + ivec2(i % 3 - 1, i / 3 - 1), last);
        hits += VALID(v[i]) ? 1 : 0;
    }
    // Every round of bubble sort puts the largest remaining value in its place: five rounds reach the middle of nine. A miss is
    // larger than any hit, so that eight rounds reach the middle of the hits.
#ifdef DISTANCE
    const int ROUNDS = 8;
#else
    const int ROUNDS = 5;
#endif
    for (int round = 0; round < ROUNDS; ++round) {
        for (int i = 0; i < 8 - round; ++i) {
            float low = min(v[i], v[i + 1]), high = max(v[i], v[i + 1]);
            v[i] = low;
            v[i + 1] = high;
        }
    }
    return v[(hits - 1) / 2];
}

// One explicit step of 0.2 with four neighbours (Perona and Malik 1990).
float perona_malik_of(ivec2 at, ivec2 last) {
    float here = level(at), flux = 0.0;
    for (int i = 0; i < 4; ++i) {
        float there = level_near(at + ivec2((i & 1) * (i - 2), (1 - (i & 1)) * (i - 1)), last);
        if (VALID(there)) flux += quotient(there - here, edge) * (there - here);
    }
    return here + 0.2 * flux;
}

// Half the pixel, half its eight neighbours by the inverse of their difference from it (Wang, Vagnucci and Li 1981).
float gradient_inverse_of(ivec2 at, ivec2 last) {
    float here = level(at), sum = 0.0, weight = 0.0;
    for (int i = 0; i < 9; ++i) {
        float there = level_near(at + ivec2(i % 3 - 1, i / 3 - 1), last);
        if (i == 4 || !VALID(there)) continue;
        float w = 1.0 / max(abs(there - here), least);
        sum += w * (there - here);
        weight += w;
    }
    return weight > 0.0 ? here + 0.5 * sum / weight : here;
}

// The nine masks of 5x5, bit 5 row + column: the square of 3x3, and of 7 pixels each four towards an edge and four towards a corner.
const int MASKS[9] = int[9](0x739c0, 0x11ce, 0xc7300, 0xe71000, 0x19c60, 0x18e3, 0x3398, 0x18e3000, 0x339800);

// Mean of the mask of least variance (Nagao and Matsuyama 1979). Masks with a miss are ignored.
float nagao_matsuyama_of(ivec2 at, ivec2 last) {
    float here = level(at), v[25];
    for (int i = 0; i < 25; ++i) v[i] = level_near(at + ivec2(i % 5 - 2, i / 5 - 2), last);
    float best = 0.0, least_variance = MISS;
    for (int m = 0; m < 9; ++m) {
        // Differences from the middle, whose square in f32 is exact enough to order the variances.
        float sum = 0.0, squares = 0.0, count = 0.0;
        bool complete = true;
        for (int i = 0; i < 25; ++i) {
            if ((MASKS[m] >> i & 1) == 0) continue;
            complete = complete && VALID(v[i]);
            float away = VALID(v[i]) ? v[i] - here : 0.0;
            sum += away;
            squares += away * away;
            count += 1.0;
        }
        float mean = sum / count, variance = squares / count - mean * mean;
        if (complete && variance < least_variance) {
            least_variance = variance;
            best = mean;
        }
    }
    return here + best;
}

float estimate(ivec2 at, ivec2 last) {
    if (ESTIMATOR == 0) return median_of(at, last);
    if (ESTIMATOR == 1) return perona_malik_of(at, last);
    if (ESTIMATOR == 2) return gradient_inverse_of(at, last);
    return nagao_matsuyama_of(at, last);
}
