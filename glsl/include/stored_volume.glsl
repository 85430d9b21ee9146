// The image of the volume holds the part that is visible. Coordinates are those of the whole volume; where an image is accessed, its
// first texel is subtracted.
ivec3 first_stored = ivec3(first_stored_column, first_stored_row, first_stored_slice);
