// Leaves out: borders in constant steps.

Step advance(RayState s, float h);  // one step of the integrator

RayState advanced(RayState s, float h) {
    return advance(s, h).state;
}
