    int slice;
#if !defined(DISTANCE) && !defined(PICTURE)
    int first_column; // of what is made of a slice
    int first_row;
#endif
