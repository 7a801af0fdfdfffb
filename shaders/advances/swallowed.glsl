// Provides constant steps that end where the law swallows the ray, on the step's chord; one that lets a ray go that was
// certain to be absorbed ends there, too.

Step advance(RayState s, float h);  // one step of the integrator
vec4 border(vec3 x);
vec3 border_heart(vec3 x);    // what the border next to x lies around
bool captured(RayState s);    // certain to be absorbed

const int ROUNDS = 2;  // of Newton's method; a border around something is met from its outer side, without overshoot

RayState advanced(RayState s, float h) {
    RayState after = advance(s, h).state;
    vec3 along = after.x - s.x;
    vec3 heart = border_heart(s.x + 0.5 * along);
    float nearest = clamp(dot(heart - s.x, along) / max(dot(along, along), 1e-37), 0.0, 1.0);
    bool let_go = captured(s) && !captured(after);
    if (border(s.x + nearest * along).w > 0.0 && !let_go) return after;
    float t = 0.0;
    for (int i = 0; i < ROUNDS; ++i) {
        vec4 edge = border(s.x + t * along);
        float closing = -dot(edge.xyz, along);
        if (closing > 0.0) t = clamp(t + edge.w / closing, 0.0, nearest);
    }
    vec3 x = s.x + t * along;
    vec4 edge = border(x);  // what is left is taken away along the border's gradient
    return RayState(x - edge.w / max(dot(edge.xyz, edge.xyz), 1e-30) * edge.xyz, mix(s.v, after.v, t));
}
