// True inside the rendered box and on the near side of every clip plane but `face`, on which the place lies; -1: of every one.
bool is_kept(vec3 p, int face) {
    bool kept = all(greaterThanEqual(p, box_low)) && all(lessThanEqual(p, box_high));
    for (int i = 0; i < CLIPS; ++i) {
        vec4 plane = clip_at(i);
        kept = kept && (i == face || dot(plane.xyz, p) <= plane.w);
    }
    return kept;
}

bool is_kept(vec3 p) { return is_kept(p, -1); }
