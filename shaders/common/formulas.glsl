// Provides what typed formulas call and GLSL lacks or leaves undefined (addon/core/expressions.py prints the calls).

// a^n, right for a < 0, too.
float formula_power(float a, int n) {
    float result = 1.0;
    for (int rest = abs(n); rest > 0; rest >>= 1) {
        if ((rest & 1) == 1) result *= a;
        a *= a;
    }
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
