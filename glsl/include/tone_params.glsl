    float brightness;
    float contrast;
    float exponent; // 1 / gamma
    vec3 map_0;
    vec3 map_1;
    vec3 map_2;
    vec3 map_3;
    vec3 map_4;
