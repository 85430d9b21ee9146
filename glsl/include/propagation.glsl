// Light from one layer of cells to the next, across the axis that the light is nearest to: shifted along the light's direction, spread, and
// absorbed, red least. The kernel of 3 x 3 has the mean and the variance that are asked for, whatever the shift, and no weight is negative as
// long as the variance lies between 1/4 and 3/4 of the square of its stride, or from 1/4 with a stride of 1.
layout(constant_id = 0) const int AXIS = 2;  // across which layers lie
layout(constant_id = 1) const int FIRST = 0; // 1: begins with the layer that light meets first, unspread
layout(constant_id = 2) const int STRIDE = 1; // cells between two of the kernel
uniform texture3D matter;
uniform texture2D front;
uniform writeonly image2D next_front;
uniform writeonly image3D arriving;

vec3 weights_of(float shift) {
    float spread = (variance + shift * shift) / float(STRIDE * STRIDE), off = shift / float(STRIDE);
    return vec3(0.5 * (spread - off), 1.0 - spread, 0.5 * (spread + off));
}

ivec3 cell_of(int layer, ivec2 at) { return AXIS == 0 ? ivec3(layer, at) : AXIS == 1 ? ivec3(at.x, layer, at.y) : ivec3(at, layer); }

// What is left of light half of the way through a cell.
vec3 half_way(float density) { return exp(-0.5 * density * absorption); }
