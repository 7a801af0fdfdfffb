// Provides predictive control of the step size from an embedded error estimate: Gustafsson 1994; Hairer and Wanner,
// Solving Ordinary Differential Equations II, Section IV.8. An estimate of order q is C h^q; C changes along a ray, by
// orders of magnitude on its way to a black hole and away from it, and is expected to change on by the same factor:
//
//     h' = safety * (tolerance / C')^(1/q),   C' = C^2 / C before

uniform float u_tolerance;      // radians a step
uniform float u_error_order;    // q
uniform float u_inverse_order;  // 1 / q

const float SAFETY = 0.87;
const float LARGEST_GROWTH = 5.0;
const float LARGEST_CUT = 0.2;
const float LARGEST_CHANGE = 4.0;  // log2: estimates that jump are the rounding's, or a front's
const float NO_DEMAND = 1.0e30;

bool accepted(float error) {
    return finite(error) && error <= u_tolerance;
}

float first_demand() {
    return NO_DEMAND;
}

// log2 and exp2 to about 6 %, from the bits of a float: its exponent is the logarithm's whole part, its mantissa nearly the
// rest. Where the processor has no instruction for them, the right ones would take a quarter of a ray's time.
float rough_log2(float x) {
    return float(floatBitsToInt(x)) / 8388608.0 - 126.95;
}

float rough_exp2(float x) {
    return intBitsToFloat(int((x + 126.95) * 8388608.0));
}

// demand : log2 of C / tolerance at the last step that stood, or first_demand(); of this one behind the call
float adapted_step(float h, float error, inout float demand) {
    if (!finite(error)) return LARGEST_CUT * h;
    float now = rough_log2(max(error, 1e-12 * u_tolerance)) - rough_log2(u_tolerance);
    float exponent = -now;
    if (accepted(error)) {
        float before = demand;
        demand = now - u_error_order * rough_log2(h);
        if (before != NO_DEMAND) exponent -= clamp(demand - before, -LARGEST_CHANGE, LARGEST_CHANGE);
    }
    return h * clamp(SAFETY * rough_exp2(exponent * u_inverse_order), LARGEST_CUT, LARGEST_GROWTH);
}
