    vec2 shift;      // cells along the other two axes from a place to where its light comes from
    float variance;  // cells^2
    vec3 absorption; // of red, green and blue over the path through one layer of density 1
