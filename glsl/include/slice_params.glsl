    int slice; // the first that is made
#if !defined(DISTANCE) && !defined(PICTURE)
    int first_column; // of the rectangle that is made
    int first_row;
    int end_column; // the first behind it
    int end_row;
    // The texel of the volume that its image begins with.
    int first_stored_column;
    int first_stored_row;
    int first_stored_slice;
#endif
