// Provides what bends a ray far from the mass that the medium imitates: n = 1 + 2 M / r, whose gradient across the straight
// ray, integrated, is
//
//     -2 M p / (r (r + s)),   s = x.d, the way from the nearest point p
//
// The next order is that of Schwarzschild's rays (far/mass.glsl). Conserved is n |x cross d| (Bouguer), whose n is known exactly.

vec3 bend_of_medium(vec3 x, vec3 d) {
    float r = max(length(x), 1e-18);
    float along = dot(x, d);
    vec3 nearest = x - along * d;
    float way = along > 0.0 ? r + along : dot(nearest, nearest) / max(r - along, 1e-18);  // r + s, without cancellation
    return -2.0 * u_mass / r / max(way, 1e-18) * nearest;
}

const float NEXT_ORDER = 6.0;  // in M / r, of the turn

vec4 far_bend(RayState s, vec3 d) {
    vec3 turn = bend_of_medium(s.x, d);
    return vec4(turn, NEXT_ORDER * length(turn) * u_mass / max(length(s.x), 1e-18));
}

vec3 far_turn(vec3 x, vec3 d) {
    return bend_of_medium(x, -d);
}

float far_index(vec3 x, vec3 d) {
    return sqrt(medium(x).w);
}
