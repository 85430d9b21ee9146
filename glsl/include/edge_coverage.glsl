// How much of a pixel the near side of an edge covers, from which rays around it are near. The edge is a straight line, fitted by least squares to its
// heights in the columns across it.

bool is_near(ivec2 at, float limit) { return texelFetch(guide, clamp(at, ivec2(0), textureSize(guide, 0) - 1), 0).x < limit; }

// Of columns up to `columns` on both sides of a pixel, of `rows` rays on both sides of it each; the share of the pixel that is near, -1 where the
// near rays do not lie on one side of a line.
float share_of_line(ivec2 pixel, ivec2 along, ivec2 across, int columns, int rows, float limit) {
    float sum = 0.0, height = 0.0, square = 0.0, slope = 0.0, spread = 0.0;
    bool begins_near = false, ends_near = false, is_line = true;
    for (int i = -columns; i <= columns; ++i) {
        int count = 0, changes = 0;
        bool first = is_near(pixel + i * along - rows * across, limit), before = first;
        for (int j = -rows; j <= rows; ++j) {
            bool here = is_near(pixel + i * along + j * across, limit);
            count += int(here);
            changes += int(here != before);
            before = here;
        }
        if (changes > 1) is_line = false;
        if (changes == 1) {
            begins_near = begins_near || first;
            ends_near = ends_near || !first;
        }
        float weight = float((columns + 1) * (columns + 1) - i * i);
        float h = float(count) - float(rows) - 0.5;
        sum += weight;
        height += weight * h;
        square += weight * h * h;
        slope += weight * float(i) * h;
        spread += weight * float(i * i);
    }
    height /= sum;
    float rise = slope / spread;
    float off = square / sum - height * height - rise * slope / sum;
    if (!is_line || (begins_near && ends_near) || off > 0.16) return -1.0;
    // The integral of clamp(h + 1/2, 0, 1) over the pixel's width. What is flat, or nearly, has none in closed form that keeps its digits.
    float low = height + 0.5 - 0.5 * abs(rise), high = height + 0.5 + 0.5 * abs(rise);
    if (high - low < 1e-2) return clamp(height + 0.5, 0.0, 1.0);
    vec2 ends = vec2(low, high), inside = clamp(ends, 0.0, 1.0);
    vec2 integral = 0.5 * inside * inside + max(ends - 1.0, vec2(0.0));
    return (integral.y - integral.x) / (high - low);
}

// The share of a pixel with an edge that is near. It keeps half of itself, at least: its ray says where its middle is. All of it, where the rays around it
// are no line. Around an outline (`reach` 3) what is near is all that is hit; between two surfaces (`reach` 1) rays further away may be anything.
float near_share(ivec2 pixel, int reach, float limit) {
    ivec2 rise = ivec2(0);
    for (int n = 0; n < 9; ++n) {
        ivec2 offset = ivec2(n % 3, n / 3) - 1;
        if (is_near(pixel + offset, limit)) rise += offset * (2 - abs(offset.yx));
    }
    bool is_upright = abs(rise.x) > abs(rise.y);
    ivec2 along = is_upright ? ivec2(0, 1) : ivec2(1, 0);
    bool is_own = is_near(pixel, limit);
    float share = share_of_line(pixel, along, along.yx, reach, max(reach, 2), limit);
    if (share < 0.0 && reach > 1) share = share_of_line(pixel, along, along.yx, 1, 2, limit);
    if (share < 0.0) return is_own ? 1.0 : 0.0;
    return is_own ? max(share, 0.5) : min(share, 0.5);
}
