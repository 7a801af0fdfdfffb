// Leaves out what bends a ray far away, for laws that have an end.

vec4 far_bend(RayState s, vec3 d) {
    return vec4(0.0);
}

vec3 far_turn(vec3 x, vec3 d) {
    return vec3(0.0);
}

float far_index(vec3 x, vec3 d) {
    return 1.0;
}
