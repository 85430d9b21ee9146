#include "ray_block.glsl"
    float cliff; // mm between neighbours that are two surfaces
