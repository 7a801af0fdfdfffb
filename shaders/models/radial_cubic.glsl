// Provides the force of Figure 4 (c) of the paper; Groeller 1995:
//
//     xi(r) = strength (2 r^3 / R^3 - 3 r^2 / R^2 + 1)  for r <= R, 0 outside
//
// which is (1 - s)^2 (1 + 2 s) with s = r / R: without cancellation near the rim.

float xi(float r) {
    float s = min(r / u_R, 1.0);
    return u_strength * (1.0 - s) * (1.0 - s) * (1.0 + 2.0 * s);
}

float potential(float r) {
    float s = min(r / u_R, 1.0);
    return u_strength * u_R * (s * (1.0 - s * s * (1.0 - 0.5 * s)) - 0.5);
}

// Up to the ball, and through it in steps that cannot miss it.
float longest_way(float r) {
    return max(r - u_R, 0.0) + 0.5 * u_R;
}
