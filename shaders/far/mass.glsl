// Provides how a mass M bends a ray far away, to the first order, in Schwarzschild's r. The orbit is u'' + u = 3 M u^2 in
// u = 1/r and the angle (Binet's equation, models/schwarzschild_orbit.glsl); perturbing the straight ray, u = sin(phi) / b,
// what is left of its turn is
//
//     M b^3 (2 r + s) / (r^3 (r + s)^2)   towards the centre,   s = x.d, the way from the point nearest to it:
//
// 3 M b^3 / (4 r^4) for a ray that leaves, 4 M / b from one infinity to the other. The next order is 15 pi M / 16 b of that
// whole, and less of what is left of it far out; as both ways count, twice that is what is said to be left out.
// Conserved is the impact parameter h / E = b (1 - 2 M b^2 / r^3)^(-1/2).

const float NEXT_ORDER = 6.0;  // in M / r, of the turn

vec3 bend_of_mass(vec3 x, vec3 d) {
    float r = max(length(x), 1e-18);
    float along = dot(x, d);
    vec3 nearest = x - along * d;
    float b_squared = dot(nearest, nearest);
    float way = max(along > 0.0 ? r + along : b_squared / max(r - along, 1e-18), 1e-18);  // r + s, without cancellation
    return -u_mass / r * (b_squared / (r * way)) * ((2.0 * r + along) / way) * (nearest / r);
}

vec3 far_turn(vec3 x, vec3 d) {
    return bend_of_mass(x, -d);
}

float far_index(vec3 x, vec3 d) {
    vec3 moment = cross(x, d);
    float r = max(length(x), 1e-18);
    return inversesqrt(max(1.0 - 2.0 * u_mass / r * dot(moment, moment) / (r * r), 0.1));
}
