// A colour as the screen shows it: contrast around middle grey, brightness, gamma, colour map.
vec3 toned(vec3 c) {
    c = clamp((c - 0.5) * contrast + 0.5 + brightness, 0.0, 1.0);
    if (GAMMA != 0) {
        // A driver's pow(0, x) may be any result of log2(0) * x.
        c = mix(pow(max(c, vec3(1e-8)), vec3(exponent)), vec3(0.0), lessThanEqual(c, vec3(1e-8)));
    }
    if (COLOUR_MAP == 1) {
        float grey = dot(c, vec3(0.2126, 0.7152, 0.0722)) * 4.0;
        vec3 low = mix(map_0, map_1, clamp(grey, 0.0, 1.0));
        low = mix(low, map_2, clamp(grey - 1.0, 0.0, 1.0));
        low = mix(low, map_3, clamp(grey - 2.0, 0.0, 1.0));
        c = mix(low, map_4, clamp(grey - 3.0, 0.0, 1.0));
    }
    return c;
}
