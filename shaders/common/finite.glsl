// Provides a test for NaN and infinity that no compiler may optimise away: isnan() may be, under fast math.

bool finite(vec3 a) {
    return dot(a, a) < 3.0e38;
}
