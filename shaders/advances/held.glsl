// Provides constant steps of a law with several regions: each takes the formula of the region that it begins in.

Step advance(RayState s, float h);  // one step of the integrator
void hold(vec3 x);

RayState advanced(RayState s, float h) {
    hold(s.x);
    return advance(s, h).state;
}
