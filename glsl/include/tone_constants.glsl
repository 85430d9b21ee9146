layout(constant_id = 30) const int COLOUR_MAP = 0; // 1: a colour map is applied to the brightness
layout(constant_id = 31) const int GAMMA = 1;      // 0: no gamma
