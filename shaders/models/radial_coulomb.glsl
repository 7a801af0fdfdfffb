// Provides the force of Coulomb and Newton: xi(r) = k / r^2, attractive for k > 0.

float xi(float r) {
    return u_k / (r * r);
}

float potential(float r) {
    return -u_k / r;
}

// A quarter of the radius: a ray that falls in meets the core before it is through.
float longest_way(float r) {
    return 0.25 * r;
}
