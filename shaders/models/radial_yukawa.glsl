// Provides the force of Yukawa's potential V(r) = zeta exp(-mu r) / r, repulsive for zeta > 0; paper Section 5.2.

float potential(float r) {
    return u_zeta * exp(-u_mu * r) / r;
}

float xi(float r) {
    return -(1.0 + u_mu * r) / r * potential(r);
}

// A quarter of the radius: a ray that falls in meets the core before it is through.
float longest_way(float r) {
    return 0.25 * r;
}
