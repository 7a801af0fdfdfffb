// Provides what typed formulas call and GLSL lacks or leaves undefined (addon/core/expressions.py prints the calls).

// a^n for whole numbers from -63 to 63, right for a < 0, too. Without a loop: n is a constant wherever it is called, and a
// compiler that does not unroll loops takes minutes for a formula with many powers.
float formula_power(float a, int n) {
    int bits = abs(n);
    float a2 = a * a, a4 = a2 * a2, a8 = a4 * a4, a16 = a8 * a8, a32 = a16 * a16;
    float result = (bits & 1) != 0 ? a : 1.0;
    if ((bits & 2) != 0) result *= a2;
    if ((bits & 4) != 0) result *= a4;
    if ((bits & 8) != 0) result *= a8;
    if ((bits & 16) != 0) result *= a16;
    if ((bits & 32) != 0) result *= a32;
    return n < 0 ? 1.0 / result : result;
}

// a^b as numpy has it: a < 0 with a whole b has a value, 0^0 is 1, 0^b with b < 0 is infinite.
float formula_power(float a, float b) {
    if (b == 0.0) return 1.0;
    if (a == 0.0) return b > 0.0 ? 0.0 : uintBitsToFloat(0x7f800000u);
    float size = pow(abs(a), b);
    if (a > 0.0) return size;
    if (floor(b) != b) return uintBitsToFloat(0x7fc00000u);  // no real number
    return mod(b, 2.0) == 0.0 ? size : -size;
}

// GLSL's own are good to some 1e-4 only.
float formula_asin(float a) {
    return atan(a, sqrt((1.0 - a) * (1.0 + a)));
}

float formula_acos(float a) {
    return atan(sqrt((1.0 - a) * (1.0 + a)), a);
}

// GLSL's own may be infinity over infinity.
float formula_tanh(float a) {
    return tanh(clamp(a, -12.0, 12.0));
}
