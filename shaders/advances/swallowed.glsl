// Provides constant steps that end where the law swallows the ray, on the step's chord; one that lets a ray go that was
// certain to be absorbed ends there, too.

Step advance(RayState s, float h);  // one step of the integrator
vec4 border(vec3 x);
float leapt_over(RayState before, RayState after);  // the part of a step beyond a border that both its ends are outside of
bool captured(RayState s);                           // certain to be absorbed

const int ROUNDS = 3;  // of Newton's method; a border around something is met from its outer side, without overshoot

RayState advanced(RayState s, float h) {
    RayState after = advance(s, h).state;
    bool let_go = captured(s) && !captured(after);
    if (border(after.x).w > 0.0 && leapt_over(s, after) == 0.0 && !let_go) return after;
    vec3 along = after.x - s.x;
    float t = 0.0;
    for (int i = 0; i < ROUNDS; ++i) {
        vec4 edge = border(s.x + t * along);
        float closing = -dot(edge.xyz, along);
        if (closing > 0.0) t = clamp(t + edge.w / closing, 0.0, 1.0);
    }
    vec3 x = s.x + t * along;
    vec4 edge = border(x);
    return RayState(x - edge.w / max(dot(edge.xyz, edge.xyz), 1e-30) * edge.xyz, mix(s.v, after.v, t));
}
