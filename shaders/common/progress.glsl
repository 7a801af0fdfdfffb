// Provides a test for steps that float32 cannot make any more. A chart of orbits has one of its own.

const float ROUNDING = 5.96e-8;  // 2^-24: the largest relative rounding of float32

#ifndef ORBIT
// Whether a step is too short to move x. A ray whose error allows no longer one would stay there for ever.
bool stalls(RayState s, float h) {
    return h * h * dot(s.v, s.v) < ROUNDING * ROUNDING * dot(s.x, s.x);
}
#endif
