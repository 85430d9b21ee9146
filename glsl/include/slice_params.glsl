    int slice;
#if !defined(DISTANCE) && !defined(PICTURE)
    int first_column; // of the rectangle that is made
    int first_row;
#endif
