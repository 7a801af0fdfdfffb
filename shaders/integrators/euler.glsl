// Provides Euler's method, Eq. (2) of the paper: first order, one evaluation of the right-hand side.

RayState rhs(RayState s);  // d/dtau of the state

Step advance(RayState s, float h) {
    RayState derivative = rhs(s);
    return Step(RayState(s.x + h * derivative.x, s.v + h * derivative.v), 0.0);
}
