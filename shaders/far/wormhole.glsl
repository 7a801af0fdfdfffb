// Provides what bends a ray far from a throat: n = 1 + e / r^2, e = b^2 / 4, whose gradient across the straight ray,
// integrated, is
//
//     -2 e p integral ds / r^4 = -e p (phi - sin(phi) cos(phi)) / (q r)^3,   sin(phi) = q = |p| / r,
//
// p the nearest point, phi the angle between x and d. The next order is 9/4 e / b^2 of the whole turn, and counted twice, as
// both ways are. Conserved is n |x cross d| (Bouguer),
// whose n is known exactly.

vec3 bend_of_throat(vec3 x, vec3 d) {
    float r = max(length(x), 1e-18);
    float along = dot(x, d);
    vec3 nearest = x - along * d;
    float q = min(length(nearest) / r, 1.0);
    float phi = atan(q, along / r);
    // (phi - sin(phi) cos(phi)) / 2 q^3; a series where the difference has no digits
    float whole = phi < 0.3 ? (1.0 + q * q * (0.3 + q * q * 9.0 / 56.0)) / 3.0 : 0.5 * (phi - q * along / r) / (q * q * q);
    return -2.0 * excess(x) * whole / r * nearest;
}

vec4 far_bend(RayState s, vec3 d) {
    vec3 turn = bend_of_throat(s.x, d);
    return vec4(turn, 4.5 * length(turn) * excess(s.x));
}

vec3 far_turn(vec3 x, vec3 d) {
    return bend_of_throat(x, -d);
}

float far_index(vec3 x, vec3 d) {
    return 1.0 + excess(x);
}
