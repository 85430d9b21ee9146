echolume report error tests/data/bone-l14/bone.mha --preset bone --mode vr --size 256x256 --dial step --dial format --dial compositing --dial rays --dial pipeline
