// Provides tests for NaN and infinity that no compiler may optimise away. Under fast math no number is NaN: isnan() may be
// false then, and a comparison that NaN fails may be turned into one that it passes. Hence the bits, as whole numbers.

const float INFINITE = 3.2e38;       // an error that no step can have
const uint TOO_LARGE = 0x7f61b1e6u;  // the bits of 3.0e38

// The bits of |a|, which grow as |a| does; infinity's are larger than any number's, and NaN's larger still.
uint size_bits(float a) {
    return floatBitsToUint(a) & 0x7fffffffu;
}

bool finite(float a) {
    return size_bits(a) < TOO_LARGE;
}

// Whether a is three numbers that float32 can square, and so are their squares' sums.
bool finite(vec3 a) {
    return finite(dot(a, a));
}

// Whether t lies in [0, end); NaN does not.
bool lies_before(float t, float end) {
    return t >= 0.0 && size_bits(t) < floatBitsToUint(end);
}

// a with length 1, or the other where a has none that float32 can square.
vec3 unit_or(vec3 a, vec3 other) {
    float length_squared = dot(a, a);
    return length_squared > 1.0e-30 && finite(length_squared) ? a * inversesqrt(length_squared) : other;
}
