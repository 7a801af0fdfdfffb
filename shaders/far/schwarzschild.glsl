// Provides what bends a ray beyond the bounding sphere around a hole at rest: far/mass.glsl.

vec4 far_bend(RayState s, vec3 d) {
    vec3 turn = bend_of_mass(s.x, d);
    return vec4(turn, NEXT_ORDER * length(turn) * u_mass / max(length(s.x), 1e-18));
}
