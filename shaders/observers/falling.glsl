// Provides an observer who falls: the model gives the state of a ray that he measures the energy 1 of.

RayState falling_state(vec3 x, vec3 direction);  // the model's
RayState rhs(RayState s);
vec3 ray_direction(RayState s);

vec3 chart_direction(vec3 x, vec3 direction) {
    return ray_direction(falling_state(x, direction));
}

vec3 chart_vector(vec3 x, vec3 direction) {
    return length(direction) * rhs(falling_state(x, normalize(direction))).x;
}

// What he moves with is far away a 4 M / r, and almost along x: the moment of the directions does not see it.
vec3 change_at_rest(vec3 towards, vec3 off) {
    return off;
}

// Scaled as every other first state is: to |dx/dlambda| = 1.
RayState first_state(vec3 x, vec3 direction) {
    RayState s = falling_state(x, direction);
    return RayState(x, s.v / length(rhs(s).x));
}
#ifdef FREQUENCY

float energy(RayState s);  // the model's: at infinity

float frequency_shift(vec3 x, vec3 direction) {
    return 1.0 / max(energy(falling_state(x, direction)), 1e-30);
}
#endif
