// Provides straight rays: f = 0. State: x, v with |v| = 1, so that tau is the length of the ray.

RayState initial_state(vec3 x, vec3 d) {
    return RayState(x, d);
}

RayState rhs(RayState s) {
    return RayState(s.v, vec3(0.0));
}

vec3 ray_direction(RayState s) {
    return s.v;
}

bool absorbed(RayState s) {
    return false;
}

float longest_step(RayState s) {
    return 1.0e30;
}

// Conserved: the direction.
vec4 invariants(RayState s) {
    return vec4(s.v, 0.0);
}
