// The 3D filter of the thesis (4.3): a Gaussian about each sample of the ray, across it and along it, made while the ray is
// cast. Only the front slice is new at each step; the sums of the slices behind it are kept. Taps outside the insonified
// region are left out and the rest renormalised.

const float SAMPLE_AT = 0.5; // samples lie in the middle of their steps

struct Slices {
    vec2 a, b, c, d, e; // weighted sums and weights of the last slices, the newest last
    int newest;
};

// Deviation sqrt(n - 1) / 2 steps, as the binomial of that length has.
float tap_weight(int away) { return exp(-float(away * away) * 2.0 / float(max(SLIDING - 1, 1))); }

vec2 front_slice(Ray ray, int i, float sample_at) {
    float at = float(i) + sample_at;
    vec3 p = ray.origin + ray.direction * (ray.enter + offset_of(ray, at));
    // Across the ray, a step apart as along it.
    vec3 sideways = origin_dx + direction_dx;
    vec3 across = normalize(sideways - ray.direction * dot(sideways, ray.direction));
    vec3 upwards = cross(across, ray.direction);
    float apart = length_of(ray, at - 0.5);
    vec2 sum = vec2(0.0);
    for (int n = 0; n < SLIDING * SLIDING; ++n) {
        int x = n % SLIDING - SLIDING / 2, y = n / SLIDING - SLIDING / 2;
        vec3 texel;
        if (locate(p + (across * float(x) + upwards * float(y)) * apart, texel)) {
            sum += tap_weight(x) * tap_weight(y) * vec2(raw_volume(texel), 1.0);
        }
    }
    return sum;
}

Slices no_slices() { return Slices(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), -0x40000000); }

// The filtered sample i of a ray. Steps may be skipped or taken back: what is missing is summed anew.
//
// Slices move to their places before the loop, and the loop only fills places. A loop that hands each slice on to the next
// place, as `a = b; b = c; ...`, and that rays leave after different numbers of rounds, is compiled wrongly by llvmpipe
// (Mesa 22.3): what is in use behind a loop without having been computed in it is copied at the start of every round,
// whether a ray is still in the loop or not, and by then the place it is copied from holds the next slice.
float slid(Ray ray, int i, float sample_at, inout Slices s) {
    const int half_width = SLIDING / 2;
    int missing = i + half_width - s.newest;
    if (missing < 0 || missing > SLIDING) missing = SLIDING;
    if ((missing & 1) != 0) s = Slices(s.b, s.c, s.d, s.e, s.e, 0);
    if ((missing & 2) != 0) s = Slices(s.c, s.d, s.e, s.e, s.e, 0);
    if ((missing & 4) != 0) s.a = s.e;
    s.newest = i + half_width;
    for (int away = missing - 1; away >= 0; --away) {
        vec2 sum = front_slice(ray, s.newest - away, sample_at);
        s.a = away == 4 ? sum : s.a;
        s.b = away == 3 ? sum : s.b;
        s.c = away == 2 ? sum : s.c;
        s.d = away == 1 ? sum : s.d;
        s.e = away == 0 ? sum : s.e;
    }
    float near = tap_weight(1), far = SLIDING == 5 ? tap_weight(2) : 0.0;
    vec2 sum = SLIDING == 5 ? s.c + near * (s.b + s.d) + far * (s.a + s.e) : s.d + near * (s.c + s.e);
    return sum.y > 0.0 ? windowed(sum.x / sum.y) : 0.0;
}

// Sample i, whose own place has these texture indices.
float sample_along(Ray ray, int i, float sample_at, vec3 texel, inout Slices s) {
    return SLIDING == 0 ? sample_volume(texel) : slid(ray, i, sample_at, s);
}
