// Ray integration, Section 3.2: up to u_steps steps of the ODE, then one chord is handed to the intersection.
// With constant steps it is drawn with (n, h); step doubling draws it with (n, h) and with (2n, h/2). Where the method
// estimates its own error, every single step adapts, and the chord ends early where the ray strays too far from it.

Step advance(RayState s, float h);  // one step of the integrator
bool absorbed(RayState s);          // the model swallowed the ray
#ifdef TIMED
float time_left(float tau);         // until the model ends a ray that has met nothing
#endif
#ifdef EMBEDDED
float adapted_step(float h, float error, inout float demand);  // the next step size, from the last two estimates
bool accepted(float error);                                    // whether a step stands
float first_demand();                                          // what stands for the first of them at the beginning
float longest_step(RayState s);  // so that no step can jump over what the model has at its centre

uniform float u_smallest_step;
#endif

uniform sampler2D u_x;  // x, tau
uniform sampler2D u_v;  // v, h
uniform int u_steps;
uniform float u_step_factor;

out vec4 out_x;
out vec4 out_v;
#ifdef EFFORT
uniform sampler2D u_effort;
out vec4 out_effort;  // summed error estimate, steps, those of them that did not stand
#endif

#ifdef CHORDS
float sagitta_excess(RayState a, RayState b, float tau);  // how far the ray strays from its chord, of what is allowed
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 x = texelFetch(u_x, pixel, 0);
    vec4 v = texelFetch(u_v, pixel, 0);
    RayState s = RayState(x.xyz, v.xyz);
#ifdef EMBEDDED
    float h = v.w;
    float tau = x.w;
    float demand = first_demand();
    float summed_error = 0.0;
    int taken = 0;
    int rejected = 0;
#ifdef CHORDS
    RayState first = s;
#endif
    for (; taken < u_steps; ++taken) {
        if (absorbed(s)) break;
        h = min(h, longest_step(s));
#ifdef TIMED
        if (time_left(tau) <= 0.0) break;
        h = min(h, time_left(tau));
#endif
        Step attempt = advance(s, h);
        bool stands = accepted(attempt.error);
        float next = adapted_step(h, attempt.error, demand);
#ifdef CHORDS
        // The sagitta grows with the square of the step. One step alone has to be a good enough chord.
        float excess = sagitta_excess(s, attempt.state, tau + h);
        next = min(next, h * inversesqrt(max(excess, 0.04)));
        if (excess > 1.5) stands = false;
#endif
        bool too_small = next <= h && (!stands && next < u_smallest_step || stalls(s, next));
        if (stands) {
            s = attempt.state;
            tau += h;
            summed_error += attempt.error;
        } else {
            ++rejected;
        }
        h = next;
        // A step that may not become smaller is marked by its sign; the termination pass ends the ray.
        if (too_small) {
            h = -h;
            ++taken;
            break;
        }
#ifdef CHORDS
        // With as much way again its sagitta would be four times as large.
        if (sagitta_excess(first, s, tau) > 0.25) {
            ++taken;
            break;
        }
#endif
    }
    out_x = vec4(s.x, tau);
    out_v = vec4(s.v, h);
#ifdef EFFORT
    out_effort = texelFetch(u_effort, pixel, 0) + vec4(summed_error, float(taken), float(rejected), 0.0);
#endif
#else
    float h = v.w * u_step_factor;
#ifdef TIMED
    h = min(h, time_left(x.w) / float(u_steps));
#endif
    int taken = 0;
    for (; taken < u_steps; ++taken) {
        if (absorbed(s)) break;
        s = advance(s, h).state;
    }
    out_x = vec4(s.x, x.w + float(taken) * h);
    out_v = vec4(s.v, v.w);
#endif
}
