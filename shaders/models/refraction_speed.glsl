// Provides the equation with |v| = n put in, for a medium that thins out without end: what |v| is off by where n is 1 would
// be many times n where that is a hundredth, and bend the ray by as much. Of v only the direction counts here:
//
//     dx/dtau = n v / |v|,   dv/dtau = 1/2 grad(n^2) |v| / n

RayState rhs(RayState s) {
    vec4 here = medium(s.x);
    float stretched = length(s.v) * inversesqrt(max(here.w, 1e-30));
    return RayState(s.v / max(stretched, 1e-30), stretched * here.xyz);
}
