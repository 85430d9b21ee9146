// Conditions the lines of a polar frame before scan conversion: time gain compensation, Gaussian low pass and decimation along the
// line, log compression (thesis 4.3). Output j is centred on input j FACTOR.
#version 460
#include "common.glsl"
layout(constant_id = 0) const int RADIUS = 0; // taps of the low pass on one side
layout(constant_id = 1) const int FACTOR = 1; // decimation factor
layout(constant_id = 2) const int LOG = 0;    // 0 input is log-compressed, 1 input is linear envelopes
layout(constant_id = 3) const int GAINED = 0; // 1: with time gain compensation
layout(scalar) uniform Params {
    float gain; // stored value to 0..1
    float offset;
    float narrowness; // of the low pass: 1 / (2 sigma^2), 1/sample^2
    float per_octave; // 20 log10(2) / dynamic range
};
uniform texture2DArray frames; // the batch's first frame is layer 0
readonly buffer Tgc { float entry[]; } tgc; // gain per sample: a factor of envelopes, an addend of compressed samples
uniform writeonly image2DArray conditioned; // a layer for each frame of the batch

float sample_at(ivec2 at) {
    float value = clamp(texelFetch(frames, ivec3(at, gl_GlobalInvocationID.z), 0).x * gain + offset, 0.0, 1.0);
    if (GAINED == 1) value = LOG == 1 ? value * tgc.entry[at.x] : value + tgc.entry[at.x];
    return value;
}

void main() {
    ivec3 at = ivec3(gl_GlobalInvocationID);
    if (any(greaterThanEqual(at, imageSize(conditioned)))) return;
    int last = textureSize(frames, 0).x - 1;
    // Taps beyond the ends of the line are omitted and the weights renormalised.
    float sum = 0.0, weight = 0.0;
    for (int i = -RADIUS; i <= RADIUS; ++i) {
        int tap = at.x * FACTOR + i;
        float w = tap < 0 || tap > last ? 0.0 : exp(-float(i * i) * narrowness);
        sum += w * sample_at(ivec2(clamp(tap, 0, last), at.y));
        weight += w;
    }
    float value = sum / weight;
    // No logarithm of 0: values below the smallest normal float are far below any dynamic range.
    if (LOG == 1) value = 1.0 + per_octave * log2(max(value, 1.2e-38));
    imageStore(conditioned, at, vec4(clamp(value, 0.0, 1.0), 0.0, 0.0, 0.0));
}
