// Provides the way across a border on which n jumps, or which a thin front ends at: Snell's law. What v is along the border
// stays, and |v| is n on the other side; where there is no such v, the ray is reflected.

RayState rhs(RayState s);
vec4 medium(vec3 x);  // half the gradient of n^2, and n^2
vec4 border(vec3 x);
void hold(vec3 x);    // the region that x is in
bool settles();       // whether |v| is set to n when the ray leaves the held region

const float NUDGE = 3.0e-7;  // of |x|: what rounding may leave a place on the border on its wrong side by

void cross_border(inout RayState s, inout RayState rate) {
    vec3 onwards = -normalize(border(s.x).xyz);
    vec3 step_on = NUDGE * length(s.x) * onwards;
    bool is_set = settles();
    hold(s.x + step_on);
    float across = dot(s.v, onwards);
    vec3 tangential = s.v - across * onwards;
    float under_root = medium(s.x + step_on).w - dot(tangential, tangential);
    bool reflected = is_set && under_root < 0.0;
    if (is_set) s.v = tangential + (reflected ? -across : sqrt(max(under_root, 0.0))) * onwards;
    s.x += reflected ? -step_on : step_on;
    if (reflected) hold(s.x);
    rate = rhs(s);
}
