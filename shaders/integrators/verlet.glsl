// Provides velocity Verlet: second order. For dx/dtau = v it is the textbook's
//
//     v_half = v + h/2 f(x, v),   x' = x + h v_half,   v' = v_half + h/2 f(x', v + h f)
//
// and written so that it keeps its order where dx/dtau is any function of x and v (Kerr's momenta, flows): the
// trapezoidal rule in x, with the velocity of the middle.

RayState rhs(RayState s);  // d/dtau of the state

Step advance(RayState s, float h) {
    RayState first = rhs(s);
    vec3 v_half = s.v + 0.5 * h * first.v;
    vec3 along = rhs(RayState(s.x, v_half)).x;
    vec3 x = s.x + 0.5 * h * (along + rhs(RayState(s.x + h * along, v_half)).x);
    vec3 v = v_half + 0.5 * h * rhs(RayState(x, s.v + h * first.v)).v;
    return Step(RayState(x, v), 0.0);
}
