// Provides a test for NaN and infinity that no compiler may optimise away: isnan() may be, under fast math, and so may what
// a comparison with NaN gives. Bits are compared as whole numbers.

const float INFINITE = 3.2e38;  // an error that no step can have

// Whether a is three numbers that float32 can square.
bool finite(vec3 a) {
    return all(lessThan(floatBitsToUint(a) & 0x7fffffffu, uvec3(floatBitsToUint(1.0e19))));
}

// a with length 1, or the other where a has none that float32 can square.
vec3 unit_or(vec3 a, vec3 other) {
    float length_squared = dot(a, a);
    return length_squared > 1.0e-30 && length_squared < 3.0e38 ? a * inversesqrt(length_squared) : other;
}
