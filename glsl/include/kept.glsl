// True inside the rendered box and on the near side of every clip plane.
bool is_kept(vec3 p) {
    bool kept = all(greaterThanEqual(p, box_low)) && all(lessThanEqual(p, box_high));
    for (int i = 0; i < CLIPS; ++i) {
        vec4 plane = i == 0 ? clip_0 : i == 1 ? clip_1 : i == 2 ? clip_2 : clip_3;
        kept = kept && dot(plane.xyz, p) <= plane.w;
    }
    return kept;
}
