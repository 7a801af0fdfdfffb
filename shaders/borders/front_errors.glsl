// Provides what errors count in a thin front. It changes v by a fixed amount: after it |v| is n again (refracting.glsl),
// whatever the errors of the steps in it were. So they may be large, the larger the thinner it is, and float32 has no digits
// for small ones. What stays of them is that the ray is elsewhere at the front's end; this grows with the way in the front,
// 1 / cosine times as long at a slant, and with what part of the front that is, until the front's curvature ends it.

bool settles();               // whether |v| is set to n when the ray leaves the held region
vec3 front_direction(vec3 x);  // across it, of any length
float front_thickness();       // in parts of its radius
float front_width();           // model lengths

const float SHORT_ENOUGH = 0.0625;  // of its width: a step that stands whatever its estimate, which is float32's noise

float error_weight(RayState s, float h) {
    if (!settles()) return 1.0;
    if (h * length(s.v) <= SHORT_ENOUGH * front_width()) return 0.0;
    vec3 normal = front_direction(s.x);
    float across = dot(normal, s.v);
    float squared_cosine = across * across / max(dot(normal, normal) * dot(s.v, s.v), 1e-30);
    return min(3.0 * front_thickness() / (front_thickness() + squared_cosine), 1.0);
}
