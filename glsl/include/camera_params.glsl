#include "ray_block.glsl"
    float cliff; // neighbours further apart than this are two surfaces, mm
