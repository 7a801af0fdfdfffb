// Provides what bends a ray beyond the bounding sphere around a rotating mass, to the first orders in M and a M. In
// Kerr-Schild coordinates (models/kerr.glsl), along the straight ray x = n + s d, n.d = 0, with E = 1,
//
//     dp/dlambda = 1/2 grad(F m^2),   v = p - F m l,   m = 1 + l.d,   F = 2 M / r,   l = (x - a cross x / r) / r
//
// with a = (0, 0, a), so that v still turns by F m l and by the integral of 1/2 grad(F m^2), both across d. Without a
// these are Schwarzschild's orbits: far/mass.glsl. Linear in a, with w = a.(x cross d) = n.(d cross a) and
// I = 1 / (r (r + s)) + 1 / (2 r^2), they are
//
//     F m l:      -2 M / r^2 (w n / r^2 + (1 + s / r) (a cross x) / r)
//     integral:   -2 M grad(w I) = -2 M ((d cross a) I - w n ((2 r + s) / (r^3 (r + s)^2) + 1 / r^4))
//
// or 2 a M / r^2 for a ray that leaves: the chart is twisted. On the way in it is not, as m is nearly 0 there, and spin
// counts as a M b / r^3. What is left out is of the orders M^2 b / r^3 and M a^2 / r^3.

vec4 far_bend(RayState s, vec3 d) {
    float r = max(length(s.x), 1e-18);
    float along = dot(s.x, d);
    vec3 nearest = s.x - along * d;
    float way = max(along > 0.0 ? r + along : dot(nearest, nearest) / max(r - along, 1e-18), 1e-18);  // r + s
    vec3 a = vec3(0.0, 0.0, -u_spin * u_mass);
    vec3 around = cross(a, s.x);
    around -= dot(around, d) * d;
    vec3 drag = cross(d, a);
    float w = dot(nearest, drag);
    float steep = (2.0 * r + along) / (r * way) / way + 1.0 / (r * r);
    vec3 spun = (w * nearest / r + way * around / r) / r + drag * (r / way + 0.5) - w * steep * nearest;
    vec3 turn = bend_of_mass(s.x, d) - 2.0 * u_mass / (r * r) * spun;
    return vec4(turn, (NEXT_ORDER * length(turn) + dot(a, a) / (r * r)) * u_mass / r);
}
