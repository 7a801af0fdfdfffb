// Provides the equation as it stands.

vec3 acceleration(vec3 x, RayState s);

RayState rhs(RayState s) {
    return RayState(s.v, acceleration(s.x, s));
}
