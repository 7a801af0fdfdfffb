// Provides n(x) that bends light as a Schwarzschild black hole does, in isotropic coordinates (rho, not r):
//
//     n = (1 + u)^3 / (1 - u),   u = M / (2 rho),   r = rho (1 + u)^2
//
// because light knows space-time only up to a factor: ds^2 = 0 reads dt = n |dx|. The horizon is at rho = M/2.

uniform float u_mass;

// n is 800 there, and no ray that comes so near returns.
float horizon() {
    return 0.505 * u_mass;
}

vec4 medium(vec3 x) {
    float rho = max(length(x), max(0.5005 * u_mass, 1e-30));
    float u = 0.5 * u_mass / rho;
    float outside = 1.0 - u;
    float n = (1.0 + u) * (1.0 + u) * (1.0 + u) / outside;
    float slope = -(u / rho) * (1.0 + u) * (1.0 + u) * (4.0 - 2.0 * u) / (outside * outside);
    return vec4(n * slope / rho * x, n * n);
}

vec4 border(vec3 x) {
    float rho = length(x);
    return vec4(x / max(rho, 1e-30), rho - horizon());
}

vec3 border_heart(vec3 x) {
    return vec3(0.0);
}

const float ABSORBING = 1.0 + 1.0e-5;  // a ray that has come to the border is absorbed

bool absorbed(RayState s) {
    return length(s.x) <= ABSORBING * horizon();
}

// Half of the way to where n is infinite; what leaves from beyond the photon sphere (1.87 M) does not come back.
float longest_step(RayState s) {
    if (dot(s.x, s.v) > 0.0 && length(s.x) > 4.0 * u_mass) return 1.0e30;
    return 0.5 * max(length(s.x) - 0.5 * u_mass, 0.005 * u_mass) / max(length(s.v), 1e-30);
}
