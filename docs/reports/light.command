echolume report error tests/data/bone-l14/bone.mha --mode vr --size 256x256 --dial light-cell --dial step --dial pipeline --dial tolerance
