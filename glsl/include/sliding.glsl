// The 3D filter of the thesis (4.4.2): a Gaussian around each sample of the ray, across and along it, computed while the ray is
// cast. Each step adds the front slice only; the sums of the slices behind it are kept. Taps outside the insonified region are
// omitted and the weights renormalised.

#extension GL_EXT_control_flow_attributes : require
const float SAMPLE_AT = 0.5; // samples are in the middle of their steps

struct Slices {
    vec2 a, b, c, d, e; // weighted sums and weights of the last slices, the newest last
    int middle; // the sample that they surround
};

// The ray as a shader has it at sample i: a shader may compute its origin and direction again, instead of keeping them while taps are summed.
Ray aimed(Ray ray, int i);

// Deviation sqrt(n - 1) / 2 steps, as of the binomial of that length.
float tap_weight(float away) { return exp(-(away * away) * 2.0 / float(max(SLIDING - 1, 1))); }

vec2 front_slice(Ray ray, int i, float sample_at) {
    float at = float(i) + sample_at;
    ray = aimed(ray, i);
    vec3 p = ray.origin + ray.direction * (ray.enter + offset_of(ray, at));
    // Across the ray, with the same spacing as along it.
    vec3 sideways = origin_dx + direction_dx;
    vec3 across = normalize(sideways - ray.direction * dot(sideways, ray.direction));
    vec3 upwards = cross(across, ray.direction);
    float apart = length_of(ray, at - 0.5);
    vec2 sum = vec2(0.0);
    // A tap needs its place and weights: a counter alone would be divided for each tap. The counter says how many there are, which a
    // compiler cannot see from x and y.
    const float edge = float(SLIDING / 2);
    float x = -edge, y = -edge;
    [[dont_unroll]] for (int n = 0; n < SLIDING * SLIDING; ++n) {
        vec3 texel;
        if (locate(p + (across * x + upwards * y) * apart, texel)) {
            sum += tap_weight(x) * tap_weight(y) * vec2(raw_volume(texel), 1.0);
        }
        bool ends_row = x == edge;
        y = ends_row ? y + 1.0 : y;
        x = ends_row ? -edge : x + 1.0;
    }
    return sum;
}

Slices no_slices() { return Slices(vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), vec2(0.0), -0x40000000); }

// The filtered sample i of a ray, before the grey window. Steps may be skipped or taken back: missing slices are summed again.
//
// The slices are shifted before the loop, and the loop only fills empty places. llvmpipe (Mesa 22.3) miscompiles a loop that
// shifts them, as `a = b; b = c; ...`, and that rays leave after different numbers of iterations: a value used after the loop
// but not computed in it is copied at the start of every iteration, whether or not the ray is still in the loop, and by then
// its source holds the next slice.
float slid(Ray ray, int i, float sample_at, inout Slices s) {
    const int half_width = SLIDING / 2;
    int missing = i - s.middle;
    if (missing < 0 || missing > SLIDING) missing = SLIDING;
    if ((missing & 1) != 0) s = Slices(s.b, s.c, s.d, s.e, s.e, 0);
    if ((missing & 2) != 0) s = Slices(s.c, s.d, s.e, s.e, s.e, 0);
    if ((missing & 4) != 0) s.a = s.e;
    s.middle = i;
    for (int away = missing - 1; away >= 0; --away) {
        vec2 sum = front_slice(ray, i + half_width - away, sample_at);
        s.a = away == 4 ? sum : s.a;
        s.b = away == 3 ? sum : s.b;
        s.c = away == 2 ? sum : s.c;
        s.d = away == 1 ? sum : s.d;
        s.e = sum; // of the last iteration; what is overwritten need not be kept for it
    }
    float near = tap_weight(1.0), far = SLIDING == 5 ? tap_weight(2.0) : 0.0;
    vec2 sum = SLIDING == 5 ? s.c + near * (s.b + s.d) + far * (s.a + s.e) : s.d + near * (s.c + s.e);
    return sum.y > 0.0 ? sum.x / sum.y : 0.0;
}

// Sample i, which has these texture indices, before the grey window.
float raw_along(Ray ray, int i, float sample_at, vec3 texel, inout Slices s) {
    return SLIDING == 0 ? raw_volume(texel) : slid(ray, i, sample_at, s);
}

// The same after the window.
float sample_along(Ray ray, int i, float sample_at, vec3 texel, inout Slices s) {
    return windowed(raw_along(ray, i, sample_at, texel, s));
}
