    int slice;
#ifndef PICTURE
    // The texel of the volume that its image begins with.
    int first_stored_column;
    int first_stored_row;
    int first_stored_slice;
#endif
