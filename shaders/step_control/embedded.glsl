// Provides PI control of the step size from an embedded error estimate: Gustafsson 1991; Hairer and Wanner, Solving
// Ordinary Differential Equations II, Section IV.2. The exponents are for the order of the estimate, q:
//
//     h' = h * safety * (tolerance / error)^(0.7/q) * (error before / tolerance)^(0.4/q)

uniform float u_tolerance;     // radians a step
uniform float u_error_order;   // q

const float SAFETY = 0.87;
const float LARGEST_GROWTH = 5.0;
const float LARGEST_CUT = 0.2;

bool accepted(float error) {
    return error <= u_tolerance;  // false for NaN, too
}

float first_error() {
    return u_tolerance;
}

// log2 and exp2 to about 6 %, from the bits of a float: its exponent is the logarithm's whole part, its mantissa nearly the
// rest. Where the processor has no instruction for them, the right ones would take a quarter of a ray's time.
float rough_log2(float x) {
    return float(floatBitsToInt(x)) / 8388608.0 - 126.95;
}

float rough_exp2(float x) {
    return intBitsToFloat(int((x + 126.95) * 8388608.0));
}

float adapted_step(float h, float error, float error_before) {
    if (!(error < 3.0e38)) return LARGEST_CUT * h;
    float now = rough_log2(max(error / u_tolerance, 1e-6));
    float before = rough_log2(max(error_before / u_tolerance, 0.01));  // a far too short step must not hold back the next
    float exponent = accepted(error) ? 0.4 * before - 0.7 * now : -now;
    return h * clamp(SAFETY * rough_exp2(exponent / u_error_order), LARGEST_CUT, LARGEST_GROWTH);
}
