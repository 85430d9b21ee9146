// Linear light as a screen shows it, over the ground.
layout(constant_id = 35) const int GROUND = 0; // 1: there is a ground behind the volume

// Narkowicz's fit of the ACES film curve, and a gamma of 2.2.
vec3 film(vec3 light) {
    vec3 c = exposure * light;
    c = clamp(c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14), 0.0, 1.0);
    return mix(pow(max(c, vec3(1e-8)), vec3(1.0 / 2.2)), vec3(0.0), lessThanEqual(c, vec3(1e-8)));
}

// Light of a ray, premultiplied. The ground is brightest a little above the middle of the picture.
vec4 on_film(vec3 light, float opacity, ivec2 pixel, ivec2 size) {
    if (GROUND == 1) {
        vec2 at = (vec2(pixel) + 0.5 - 0.5 * vec2(size)) / float(min(size.x, size.y)) + vec2(0.0, 0.05);
        vec3 ground = mix(ground_edge, ground_middle, clamp(1.0 - 2.6 * dot(at, at), 0.0, 1.0));
        return vec4(film(light + (1.0 - opacity) * ground), 1.0);
    }
    return opacity > 0.0 ? vec4(opacity * film(light / opacity), opacity) : vec4(0.0);
}
