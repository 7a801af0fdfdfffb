// Provides n(x) of air over hot (B < 0) or cold (B > 0) ground, z up from the ground: n^2 = A + B e^(-c z).
// physics.md, Section 2, has its rays in closed form.

uniform float u_mirage_a;
uniform float u_mirage_b;
uniform float u_mirage_c;

const float LARGEST_EXPONENT = 60.0;

vec4 medium(vec3 x) {
    float layer = u_mirage_b * exp(min(-u_mirage_c * x.z, LARGEST_EXPONENT));
    return vec4(0.0, 0.0, -0.5 * u_mirage_c * layer, u_mirage_a + layer);
}

// Deep below the ground n^2 would be negative: no light goes there.
bool absorbed(RayState s) {
    return medium(s.x).w <= 0.0;
}

// No step may dive through the layer.
float longest_step(RayState s) {
    return max(0.5 / u_mirage_c, 0.5 * s.x.z) / max(abs(s.v.z), 1e-30);
}
