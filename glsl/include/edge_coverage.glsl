// How much of a pixel the near side of an edge covers, from the distances of the rays around it. Where a run of pixels along the edge is short, the edge is a
// straight line, fitted by least squares to its heights in the columns across it; where it is longer, or no line fits, the edge crosses the middles of
// the steps at the run's ends.
const int WINDOW = 3; // columns on both sides of the pixel, and rays on both sides of it in each
const int LONG = 4;   // pixels of a run from which its ends tell more
const int REACH = 16; // pixels on both sides up to which they are looked for

float edge_distance(ivec2 at) { return guide_at(clamp(at, ivec2(0), textureSize(rendered, 0) - 1)); }

// The integral of clamp(h + 1/2, 0, 1) over the pixel's width. What is flat, or nearly, has none in closed form that keeps its digits.
float area(float height, float rise) {
    float low = height + 0.5 - 0.5 * rise, high = height + 0.5 + 0.5 * rise;
    if (high - low < 1e-2) return clamp(height + 0.5, 0.0, 1.0);
    vec2 ends = vec2(low, high), inside = clamp(ends, 0.0, 1.0);
    vec2 integral = 0.5 * inside * inside + max(ends - 1.0, vec2(0.0));
    return (integral.y - integral.x) / (high - low);
}

// Columns to the end of a run, and which way its step goes: 1 where the pixel's side grows, 0 where the edge ends; 2 where it lies beyond the reach. The limit
// follows the two surfaces.
ivec2 run_end(ivec2 pixel, ivec2 along, ivec2 across, bool is_near, float limit) {
    for (int columns = 1; columns <= REACH; ++columns) {
        float own = edge_distance(pixel + columns * along), other = edge_distance(pixel + columns * along + across);
        bool is_own = (own < limit) == is_near, is_alike = (other < limit) == is_near;
        if (!is_own || is_alike) return ivec2(columns, int(is_alike) - int(!is_own));
        limit = 0.5 * own + 0.5 * other;
    }
    return ivec2(REACH + 1, 2);
}

// The near share by the ends of the run that the pixel is in, and the run's length; -1 where the edge is on neither side of the pixel, or on both.
float share_of_run(ivec2 pixel, ivec2 along, bool is_near, float limit, out int run) {
    ivec2 across = along.yx;
    bool is_below = (edge_distance(pixel + across) < limit) != is_near;
    run = 0;
    if (is_below == ((edge_distance(pixel - across) < limit) != is_near)) return -1.0;
    if (!is_below) across = -across;
    ivec2 left = run_end(pixel, -along, across, is_near, limit), right = run_end(pixel, along, across, is_near, limit);
    run = left.x + right.x - 1;
    // Of a run whose other end is out of reach, the edge is a straight line as far as it was seen.
    float before = float(left.y == 2 ? -right.y : left.y), after = float(right.y == 2 ? -left.y : right.y);
    if (left.y == 2 && right.y == 2) before = after = 0.0;
    float span = 0.5 * float(run), at = 0.5 * float(left.x - right.x) / span;
    float height = 0.5 * after * at, rise = 0.5 * after / span;
    if (before != -after) {
        float turn = at < 0.0 ? before : after;
        height = 0.5 * turn * at * at;
        rise = turn * at / span;
    }
    float own = area(0.5 + height, abs(rise));
    return is_near ? own : 1.0 - own;
}

// The near share below a line through the heights of the columns; -1 where they lie on no line.
float share_of_line(ivec2 pixel, ivec2 along, float limit) {
    ivec2 across = along.yx;
    float sum = 0.0, height = 0.0, square = 0.0, slope = 0.0, spread = 0.0;
    bool begins_near = false, ends_near = false, is_line = true;
    for (int i = -WINDOW; i <= WINDOW; ++i) {
        int count = 0, changes = 0;
        bool first = edge_distance(pixel + i * along - WINDOW * across) < limit, before = first;
        for (int j = -WINDOW; j <= WINDOW; ++j) {
            bool here = edge_distance(pixel + i * along + j * across) < limit;
            count += int(here);
            changes += int(here != before);
            before = here;
        }
        if (changes > 1) is_line = false;
        if (changes == 1) {
            begins_near = begins_near || first;
            ends_near = ends_near || !first;
        }
        float weight = float((WINDOW + 1) * (WINDOW + 1) - i * i);
        float h = float(count) - float(WINDOW) - 0.5;
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
    return area(height, abs(rise));
}

// The share of a pixel with an edge that is nearer than a limit. It keeps half of itself, at least: its ray says where its middle is. All of it, where no edge
// can be told. Around an outline what is near is all that is hit; between two surfaces both may have the distance of the other further away: only
// the run tells.
float near_share(ivec2 pixel, bool is_outline, float limit) {
    ivec2 rise = ivec2(0);
    for (int n = 0; n < 9; ++n) {
        ivec2 offset = ivec2(n % 3, n / 3) - 1;
        if (edge_distance(pixel + offset) < limit) rise += offset * (2 - abs(offset.yx));
    }
    ivec2 along = abs(rise.x) > abs(rise.y) ? ivec2(0, 1) : ivec2(1, 0);
    bool is_near = edge_distance(pixel) < limit;
    int run;
    float share = share_of_run(pixel, along, is_near, limit, run);
    if (is_outline && run < LONG) {
        float line = share_of_line(pixel, along, limit);
        if (line >= 0.0) share = line;
    }
    if (share < 0.0) return is_near ? 1.0 : 0.0;
    return is_near ? max(share, 0.5) : min(share, 0.5);
}
