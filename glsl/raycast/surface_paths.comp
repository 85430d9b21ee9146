// Costs of the choice among the candidates of each ray, summed along its row or its column from one side (Hirschmueller 2008, Stereo processing by
// semiglobal matching and mutual information): each path is the cheapest of all choices on the pixels up to this one. An invocation goes along one line.
#version 460
#include "common.glsl"
layout(scalar) uniform Params {
    int way;       // 0 from the left, 1 from the right, 2 from the top, 3 from the bottom
    float slope;   // price of a mm between the places of neighbours
    float jump;    // the most that it costs, and the price of a border of the surface
    float missing; // cost of no surface
};
uniform texture2D candidates;
uniform writeonly image2D path; // how much more either place costs than no surface

const float ABSENT = 1.0e4; // cost of a candidate that a ray does not have

float step_price(float from, float to) { return min(slope * min(abs(from - to), 1.0e6), jump); }

// A place costs what it is unlikely, and what the place in front of it would be taken for noise.
vec3 costs_of(vec4 here) {
    return vec3(is_hit(here.x) ? 1.0 - here.z : ABSENT, is_hit(here.y) ? 1.0 - here.w + here.z : ABSENT, missing + here.z + here.w);
}

float arrival(vec3 before, vec2 places, float place) {
    return min(min(before.x + step_price(places.x, place), before.y + step_price(places.y, place)), before.z + jump);
}

void main() {
    ivec2 size = textureSize(candidates, 0);
    int line = 64 * int(gl_WorkGroupID.x) + int(gl_LocalInvocationIndex);
    bool is_row = way < 2;
    int count = is_row ? size.x : size.y;
    if (line >= (is_row ? size.y : size.x)) return;
    vec3 before = vec3(0.0);
    vec2 places = vec2(MISS);
    for (int n = 0; n < count; ++n) {
        int at = (way & 1) == 0 ? n : count - 1 - n;
        ivec2 pixel = is_row ? ivec2(at, line) : ivec2(line, at);
        vec4 here = texelFetch(candidates, pixel, 0);
        vec3 cost = costs_of(here);
        if (n > 0) {
            vec3 least = vec3(min(before.x, min(before.y, before.z)));
            vec3 cheapest = vec3(arrival(before, places, here.x), arrival(before, places, here.y), min(min(before.x, before.y) + jump, before.z));
            cost += cheapest - least;
        }
        imageStore(path, pixel, vec4(cost.xy - cost.z, 0.0, 0.0));
        before = cost;
        places = here.xy;
    }
}
