echolume report error tests/data/bone-l14/bone.mha --preset bone --mode vr --size 256x256
