// Provides where a rotating hole swallows light that has taken many steps and can meet nothing on the way in: at the
// horizon, or as soon as it is certain to get there. At the fastest spin light may wind around a thousand times before it
// falls in, and each winding takes some forty steps. But it turns round only where R = 0 (Carter 1968),
//
//     R = P^2 - Delta K,   P = E (r^2 + a^2) - a L,   Delta = r^2 - 2 M r + a^2 <= (r - M)^2,
//
// so that inwards it never does if P > K^(1/2) (r - M) from here down to the horizon. The difference is a parabola in r.

bool absorbed(RayState s) {
    KerrSchild k = kerr_schild(s.x);
    float innermost = horizon();
    if (k.r <= ABSORBING * innermost) return true;
    float e_along = energy_and_along(k, s.v);
    vec3 grad_r = k.r * s.x + vec3(0.0, 0.0, k.a * k.a * k.c);  // times Sigma
    vec3 c = constants(k, s, e_along - dot(k.l, s.v));
    if (c.x <= 0.0 || dot(grad_r, velocity(k, s.v, e_along)) >= 0.0) return false;
    float lowest = clamp(0.5 * c.z / c.x, innermost, k.r);
    return c.x * (lowest * lowest + k.a * k.a) - k.a * c.y > c.z * (lowest - u_mass);
}
