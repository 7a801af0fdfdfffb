// Provides steps that end on a border: where the law is not smooth (a rim, a front) or swallows the ray (a horizon). A step
// that goes past one is taken again, only as far as there; one that ends next to it is moved onto it. So no method ever
// integrates across a border, and no piece of a ray that objects are tested with has parts on both sides of one.
//
// A law holds the formula of the region that the ray is in, and goes on with it smoothly beyond the region's border: the
// attempt that finds the border is then as right as any other step.

vec4 border(vec3 x);       // gradient and value of a function that is positive in the held region and 0 on its border
vec3 border_heart(vec3 x);  // what the border next to x lies around: the centre of a horizon, of a lens

// How far from the border the end of a step may be moved onto it: the state is known there to second order, the border to
// first. Parts of the step, and of |x|.
const float LANDING = 0.005;
const float LANDING_RADIUS = 1.0e-3;
const float LANDING_ROUNDING = 2.4e-7;  // float32 comes no nearer
const float SHORTEST = 1.0e-3;          // of a step, what is tried again of it at least

// How far a ray is from the border, in units of the border's function, and how fast that changes.
vec2 border_gap(RayState s, RayState rate) {
    vec4 edge = border(s.x);
    return vec2(edge.w, dot(edge.xyz, rate.x));
}

// Whether a step of h ends on the border, where the gap, as the parabola through its values at both ends and its slope at
// the last one, is 0. Comparisons are between squares, without roots and quotients.
// beyond : tau that the step goes too far; below 0, that it is short; 0: no border
bool finds_border(vec2 gap, vec2 gap_after, RayState after, RayState rate, float h, out float beyond) {
    float slope = h * gap_after.y;
    float bend = gap.x - gap_after.x + slope;
    float root = sqrt(max(slope * slope - 4.0 * bend * gap_after.x, 0.0));
    beyond = -2.0 * h * gap_after.x / max(root - slope, 1e-30);
    float speed = dot(rate.x, rate.x);
    float radius = dot(after.x, after.x);
    float landing = min(LANDING * LANDING * h * h * speed, LANDING_RADIUS * LANDING_RADIUS * radius);
    float least = LANDING_ROUNDING * LANDING_ROUNDING * radius;
    bool crossed = gap_after.x <= 0.0;
    bool found = finite(beyond) && finite(rate.x) && finite(rate.v);  // a long step into a strong force overflows
    bool lands = found && gap_after.y < 0.0 && beyond * beyond * speed <= max(landing, least);
    bool at_end = crossed && h * h * speed <= least;
    float part = found ? clamp(beyond, SHORTEST * h, (1.0 - SHORTEST) * h) : 0.5 * h;
    if (!lands) beyond = crossed && !at_end ? part : 0.0;
    return lands || at_end;
}

// The last part of a step that goes over all that the border surrounds, from the place next to its heart on; 0 for others.
float leapt_over(RayState before, RayState after) {
    vec3 along = after.x - before.x;
    float nearest = dot(border_heart(before.x + 0.5 * along) - before.x, along) / max(dot(along, along), 1e-37);
    bool leaps = nearest > 0.0 && nearest < 1.0 && border(before.x + nearest * along).w <= 0.0;
    return leaps ? min(1.0 - nearest, 1.0 - SHORTEST) : 0.0;
}

// To `beyond` before the end of a step of h: the state to second order, and its derivative.  first : the one at its start
void move_back(inout RayState after, RayState first, inout RayState last, float beyond, float h) {
    float share = beyond / h;
    RayState change = RayState(share * (last.x - first.x), share * (last.v - first.v));
    after.x -= beyond * (last.x - 0.5 * change.x);
    after.v -= beyond * (last.v - 0.5 * change.v);
    last.x -= change.x;
    last.v -= change.v;
}
