// Rays that enter tissue through a clip plane end there: they show the echo of the cut face. Where a face fades, it lies over what the ray
// finds behind it.
layout(constant_id = 39) const int CAPPED = 0; // 1: clip planes have cut faces
uniform texture2D cap; // of CAPPED: echo of the cut face; its opacity, 0 where the ray has none

vec2 cap_at(ivec2 pixel) { return CAPPED == 1 ? texelFetch(cap, pixel, 0).xy : vec2(0.0); }
bool is_capped(vec2 cut) { return CAPPED == 1 && cut.y > 0.0; }
bool ends_ray(vec2 cut) { return CAPPED == 1 && cut.y >= 1.0; }
// The colour of a cut face over what is behind it. Both are premultiplied.
vec4 capped(vec2 cut, vec4 behind) { return !is_capped(cut) ? behind : cut.y * vec4(cut.xxx, 1.0) + (1.0 - cut.y) * behind; }
