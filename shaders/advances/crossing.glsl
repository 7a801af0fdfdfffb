// Provides constant steps across a border on which the law jumps: as far as there, and the rest on the other side.

Step advance(RayState s, float h);  // one step of the integrator
vec4 border(vec3 x);
void cross_border(inout RayState s, inout RayState rate);  // into the region on the other side

const int JUMP_HALVINGS = 20;

RayState advanced(RayState s, float h) {
    RayState after = advance(s, h).state;
    if (border(after.x).w > 0.0) return after;
    float low = 0.0, high = 1.0;
    for (int i = 0; i < JUMP_HALVINGS; ++i) {
        float middle = 0.5 * (low + high);
        if (border(mix(s.x, after.x, middle)).w > 0.0) low = middle;
        else high = middle;
    }
    RayState at = advance(s, high * h).state;
    RayState rate = RayState(vec3(0.0), vec3(0.0));
    cross_border(at, rate);
    return advance(at, (1.0 - high) * h).state;
}
