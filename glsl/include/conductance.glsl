// Conductance over a difference of neighbours (Perona and Malik 1990), in a form that is finite for k from 1e-30 to 1e30: never
// g^2 times 1/k^2. Beyond 1e15 k the flow is below f32's resolution.
float relative(float g, float k) { return min(abs(g) / k, 1e15); }
float quotient(float g, float k) { float r = relative(g, k); return 1.0 / (1.0 + r * r); }
float exponential(float g, float k) { float r = relative(g, k); return exp(-r * r); }
