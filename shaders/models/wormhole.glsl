// Provides light through a wormhole (Ellis 1973; Morris and Thorne 1988, "box" with a throat of radius b):
//
//     ds^2 = -dt^2 + dl^2 + (b^2 + l^2) dOmega^2 = -dt^2 + n^2 dx.dx,   n = 1 + b^2 / (4 rho^2),   rho = |x|,
//     l = rho - b^2 / (4 rho)
//
// Space is conformally flat, so that light is refracted by n. With u = the unit tangent and lambda = the length measured
// in space (not in the chart, in which the far side shrinks to a point):
//
//     dx/dlambda = u / n,   du/dlambda = (grad n - (u.grad n) u) / n^2,   grad n = -b^2 x / (2 rho^4)
//
// rho > b/2 is the near side. rho < b/2 is the far side: x -> b^2 x / (4 rho^2) takes it to a copy of the near one, and
// rho -> 0 to its infinity. What stands inside the ball rho < b/2 stands on the far side.
// State: x in model lengths, v along u; its length stays 1 and does not enter: without that, what rounding takes from it
// would grow as n^-2 on the way out of the far side.

uniform float u_throat_radius;

RayState initial_state(vec3 x, vec3 d) {
    return RayState(x, d);
}

// b^2 / (4 rho^2) = n - 1: 1 at the throat.
float excess(vec3 x) {
    return 0.25 * u_throat_radius * u_throat_radius / max(dot(x, x), 1e-30);
}

RayState rhs(RayState s) {
    float more = excess(s.x);
    float n = 1.0 + more;
    vec3 grad_n = -2.0 * more / max(dot(s.x, s.x), 1e-30) * s.x;
    vec3 u = normalize(s.v);
    return RayState(u / n, (grad_n - dot(u, grad_n) * u) / (n * n));
}

bool far_side(vec3 x) {
    return excess(x) > 1.0;
}

// The state in the chart of its own side: the inversion turns the part of u along x round.
RayState own_side(RayState s) {
    if (!far_side(s.x)) return s;
    return RayState(excess(s.x) * s.x, s.v - 2.0 * dot(s.v, s.x) / max(dot(s.x, s.x), 1e-30) * s.x);
}

vec3 ray_direction(RayState s) {
    return normalize(s.v);
}

bool absorbed(RayState s) {
    return false;
}

// A quarter of (b^2 + l^2)^(1/2) = n rho: no step leaps through the throat.
float longest_step(RayState s) {
    return 0.25 * (1.0 + excess(s.x)) * length(s.x);
}

// Conserved: h = n x cross u (Bouguer), and |u|.
vec4 invariants(RayState s) {
    return vec4(dot(s.v, s.v), (1.0 + excess(s.x)) * cross(s.x, normalize(s.v)));
}
