// Provides the two ways to trace rays along a dynamical system x' = field(x), paper Section 5.1:
//
//     force   dx/dtau = v        dv/dtau = strength field(x)      Eq. (1) of the paper; |v| = 1 at the camera, f = 0 beyond reach
//     flow    dx/dtau = field(x)                                  Groeller 1995
//
// In flow mode a ray starts at its own point of the image plane, and v is dx/dtau: it is carried along with its own
// equation, dv/dtau = (v . grad) field, so that directions and their errors are known at every point. Where the flow
// rests, v is the direction of the camera's ray. A flow goes on for ever: a ray ends after a duration. State: x in model lengths, v in model lengths per tau.

vec3 field(vec3 x);                     // the system
vec3 field_change(vec3 x, vec3 along);  // its derivative along a vector: (along . grad) field

#ifdef FLOW
RayState initial_state(vec3 x, vec3 d) {
    vec3 start = x + u_plane_distance * d;
    vec3 v = field(start);
    return RayState(start, v == vec3(0.0) ? d : v);
}

RayState rhs(RayState s) {
    vec3 f = field(s.x);
    return RayState(f, field_change(s.x, f));
}

vec3 ray_direction(RayState s) {
    return unit_or(field(s.x), unit_or(s.v, vec3(0.0, 0.0, -1.0)));
}

float time_left(float tau) {
    return u_duration - tau;
}
#else
RayState initial_state(vec3 x, vec3 d) {
    return RayState(x, d);
}

vec3 acceleration(vec3 x, RayState s) {
    return u_strength * within_reach(length(x), u_reach) * field(x);
}

RayState rhs(RayState s) {
    return RayState(s.v, acceleration(s.x, s));
}

vec3 ray_direction(RayState s) {
    return unit_or(s.v, vec3(0.0, 0.0, -1.0));
}
#endif

bool absorbed(RayState s) {
    return false;
}

// The fields are polynomials: there is nothing small at the centre that a step could jump over.
float longest_step(RayState s) {
    return 1.0e30;
}

// Nothing is conserved.
vec4 invariants(RayState s) {
    return vec4(0.0);
}
