// Values of a lattice. One that is not known is the smallest float: shaders need not preserve NaN.
const float UNKNOWN = -3.402823466e38;
bool is_known(float value) { return value > -3.4e38; }
