// Provides light around a rotating black hole, in Cartesian Kerr-Schild coordinates (Kerr 1963; Visser 2007, Eq. 33):
//
//     g_mn = eta_mn + F l_m l_n,   F = 2 M r / Sigma,   Sigma = r^2 + a^2 c^2,   c = z / r,
//     l = (1, (r x + a y) / (r^2 + a^2), (r y - a x) / (r^2 + a^2), c),
//     H = (p.p - E^2 - F (E + l.p)^2) / 2 = 0,   dx/dlambda = dH/dp,   dp/dlambda = -dH/dx,   E = -p_t
//
// State: x in model lengths (G = c = 1), v = p, the covariant momentum; lambda is affine, |dx/dlambda| = 1 at the camera.
// E is that root of H = 0 which belongs to a ray into the future: it is no part of the state, every state is lightlike,
// and E may be negative, as it must in the ergosphere. The flow keeps E because it follows dE(x, p).
//
// Why a = -spin * mass: a ray leaves the camera against the light, into the past, and these coordinates are regular on
// the horizon only for rays that enter it into the future. t -> -t turns one into the other and turns the rotation
// round. So the camera's ray is a future one of the hole that rotates the other way, and the chart, seen from the hole
// that the user asked for (its axis is +z where spin > 0), is the outgoing Kerr-Schild one.

uniform float u_mass;
uniform float u_spin;

struct KerrSchild {
    float a;
    float r;      // from r^4 - (x.x - a^2) r^2 - a^2 z^2 = 0
    float c;      // cos theta
    float sigma;
    float f;      // F
    vec3 l;       // spatial part, a unit vector
};

KerrSchild kerr_schild(vec3 x) {
    KerrSchild k;
    k.a = -u_spin * u_mass;
    float q = dot(x, x) - k.a * k.a;
    float az = k.a * x.z;
    float root = length(vec2(q, 2.0 * az));
    // q < 0 only inside the horizon; the second form does not cancel there.
    k.r = max(sqrt(q >= 0.0 ? 0.5 * (q + root) : 2.0 * az * az / (root - q)), 1.0e-18);
    k.c = x.z / k.r;
    k.sigma = k.r * k.r + k.a * k.a * k.c * k.c;
    k.f = 2.0 * u_mass * k.r / k.sigma;
    k.l = vec3((k.r * x.xy + k.a * vec2(x.y, -x.x)) / (k.r * k.r + k.a * k.a), k.c);
    return k;
}

// E + l.p from H = 0: no difference of nearly equal numbers, and 0 for the ingoing principal null rays, p = -E l.
float energy_and_along(KerrSchild k, vec3 p) {
    float along = dot(k.l, p);
    vec3 across = p - along * k.l;
    float across_squared = dot(across, across);
    float root = sqrt(along * along + (1.0 + k.f) * across_squared);
    return along < 0.0 ? across_squared / (root - along) : (along + root) / (1.0 + k.f);
}

float energy(RayState s) {
    KerrSchild k = kerr_schild(s.x);
    return energy_and_along(k, s.v) - dot(k.l, s.v);
}

// p of the null vector (T, d): with m = T + l.d, -T^2 + d.d + F m^2 = 0 and p = d + F m l. Outside the ergosphere (F < 1)
// there is one such T into the future; inside it there are two or none, and no such camera.
RayState initial_state(vec3 x, vec3 d) {
    KerrSchild k = kerr_schild(x);
    float along = dot(k.l, d);
    vec3 across = d - along * k.l;
    float across_squared = dot(across, across);
    float root = sqrt(along * along + (1.0 - k.f) * across_squared);
    float m = along < 0.0 ? across_squared / (root - along) : (along + root) / (1.0 - k.f);
    return RayState(x, d + k.f * m * k.l);
}

vec3 radius_gradient(KerrSchild k, vec3 x) {
    return (k.r * x + vec3(0.0, 0.0, k.a * k.a * k.c)) / k.sigma;
}

vec3 velocity(KerrSchild k, vec3 p, float e) {
    return p - k.f * e * k.l;
}

RayState rhs(RayState s) {
    vec3 x = s.x, p = s.v;
    KerrSchild k = kerr_schild(x);
    float e = energy_and_along(k, p);
    float d = k.r * k.r + k.a * k.a;
    vec3 to_z = vec3(0.0, 0.0, 1.0);
    vec3 grad_r = radius_gradient(k, x);
    vec3 grad_c = (to_z - k.c * grad_r) / k.r;
    vec3 grad_f = 2.0 * u_mass / k.sigma
        * (grad_r - 2.0 * k.r / k.sigma * (k.r * grad_r + k.a * k.a * k.c * grad_c));
    // l.p = (r (x p_x + y p_y) + a (y p_x - x p_y)) / d + c p_z
    float inward = dot(x.xy, p.xy);
    float around = x.y * p.x - x.x * p.y;
    vec3 grad_along = ((inward - 2.0 * k.r * (k.r * inward + k.a * around) / d) * grad_r
        + vec3(k.r * p.xy + k.a * vec2(-p.y, p.x), 0.0)) / d + p.z * grad_c;
    return RayState(velocity(k, p, e), e * (0.5 * e * grad_f + k.f * grad_along));
}

vec3 ray_direction(RayState s) {
    KerrSchild k = kerr_schild(s.x);
    return normalize(velocity(k, s.v, energy_and_along(k, s.v)));
}

const float BORDER = 1.0 + 1.0e-5;  // in horizon radii: the rounding of r; on that border rays are absorbed
const float ABSORBING = 1.0 + 2.0e-5;

float horizon() {
    return u_mass * (1.0 + sqrt(max(1.0 - u_spin * u_spin, 0.0)));
}

vec4 border(vec3 x) {
    KerrSchild k = kerr_schild(x);
    return vec4(radius_gradient(k, x), k.r - BORDER * horizon());
}

vec3 border_heart(vec3 x) {
    return vec3(0.0);
}

// A quarter of r: a ray that falls in meets the horizon's inside before the ring. Without a mass there is nothing to meet.
float longest_step(RayState s) {
    KerrSchild k = kerr_schild(s.x);
    float speed = length(velocity(k, s.v, energy_and_along(k, s.v)));
    return u_mass > 0.0 ? 0.25 * k.r / max(speed, 1e-30) : 1.0e30;
}

// Conserved: E, L_z, and the root of Carter's K = Q + (L_z - a E)^2 = p_theta^2 + (L_z / sin theta - a E sin theta)^2, which
// is a length as L_z is. On the axis any direction serves as the one away from it.
vec3 constants(KerrSchild k, RayState s, float e) {
    float off_axis = length(s.x.xy);
    vec2 away = off_axis > 0.0 ? s.x.xy / off_axis : vec2(1.0, 0.0);
    float reach = sqrt(k.r * k.r + k.a * k.a);
    float sine = off_axis / reach;
    float p_theta = reach * k.c * dot(away, s.v.xy) - k.r * sine * s.v.z;
    float p_around = reach * (away.x * s.v.y - away.y * s.v.x);
    return vec3(e, s.x.x * s.v.y - s.x.y * s.v.x, length(vec2(p_theta, p_around - k.a * e * sine)));
}

vec4 invariants(RayState s) {
    return vec4(constants(kerr_schild(s.x), s, energy(s)), 0.0);
}

// An observer at rest measures g_ij - g_ti g_tj / g_tt = delta_ij + F / (1 - F) l_i l_j. Its square root turns chart
// directions into his; it is symmetric, so that his axes are the chart's as nearly as they can be.
vec3 static_frame(vec3 x, vec3 direction) {
    KerrSchild k = kerr_schild(x);
    return direction + (sqrt(max(1.0 - k.f, 0.0)) - 1.0) * dot(direction, k.l) * k.l;
}

// sqrt(-g_tt): the rate of a clock at rest against one at infinity.
float clock_rate(vec3 x) {
    return sqrt(max(1.0 - kerr_schild(x).f, 0.0));
}

// The observer who falls with the slices of ingoing Kerr-Schild time has u_m = -(1 + F)^(-1/2) dt. Turned round in time, and
// with Delta = r^2 - 2Mr + a^2, that is u_m = (1 + F)^(-1/2) (-dt + 4 M r / Delta dr) in this chart. Against the chart's own
// slices, whose frame is e_i = the inverse square root of delta + F l l, he moves with
//     gamma = 1 + 4 M r / Delta F / (1 + F),   gamma beta = 4 M r / Delta (1 + F)^(-1/2) (grad r - l + (1 + F)^(-1/2) l).
// The frame is boosted by that. He measures the energy 1.
RayState falling_state(vec3 x, vec3 direction) {
    KerrSchild k = kerr_schild(x);
    float delta = k.r * k.r - 2.0 * u_mass * k.r + k.a * k.a;
    float ratio = 4.0 * u_mass * k.r / max(delta, 1e-30);
    float lapse = inversesqrt(1.0 + k.f);
    vec3 grad_r = radius_gradient(k, x);
    float gamma = 1.0 + ratio * k.f * lapse * lapse;
    vec3 gamma_beta = ratio * lapse * (grad_r - (1.0 - lapse) * k.l);
    // The ray leaves him with (1, direction); see observers/moving.glsl for the same boost of light that arrives.
    vec3 n = direction + gamma_beta * (1.0 + dot(gamma_beta, direction) / (1.0 + gamma));
    return RayState(x, n + (1.0 / lapse - 1.0) * dot(n, k.l) * k.l);
}
