// Provides the way across a border on which n is continuous: the ray goes on in the other region as it is.

RayState rhs(RayState s);
vec4 border(vec3 x);
void hold(vec3 x);  // the region that x is in

const float NUDGE = 3.0e-7;  // of |x|: what rounding may leave a place on the border on its wrong side by

void cross_border(inout RayState s, inout RayState rate) {
    s.x -= NUDGE * length(s.x) * border(s.x).xyz;
    hold(s.x);
    rate = rhs(s);
}
