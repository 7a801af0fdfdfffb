// Ray integration, Section 3.2: up to u_steps steps of the ODE, then one chord is handed to the intersection.
// With constant steps it is drawn with (n, h); step doubling draws it with (n, h) and with (2n, h/2). Where the method
// estimates its own error, every single step adapts, and the chord ends early where the ray has turned too far for one.

Step advance(RayState s, float h);  // one step of the integrator
bool absorbed(RayState s);          // the model swallowed the ray
#ifdef EMBEDDED
vec3 ray_direction(RayState s);     // unit: the way the ray goes
float adapted_step(float h, float error, float error_before);  // the next step size, from the last two estimates
bool accepted(float error);                                    // whether a step stands
float first_error();                                           // what stands for the estimate before the first step
float longest_step(RayState s);  // so that no step can jump over what the model has at its centre

uniform float u_smallest_step;
uniform float u_chord_cosine;  // of the angle that a ray may turn by within one chord
#endif

uniform sampler2D u_x;  // x, tau
uniform sampler2D u_v;  // v, h
uniform int u_steps;
uniform float u_step_factor;

out vec4 out_x;
out vec4 out_v;
#ifdef EFFORT
uniform sampler2D u_effort;
out vec4 out_effort;  // summed error estimate, steps
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 x = texelFetch(u_x, pixel, 0);
    vec4 v = texelFetch(u_v, pixel, 0);
    RayState s = RayState(x.xyz, v.xyz);
#ifdef EMBEDDED
    float h = v.w;
    float tau = x.w;
    float error_before = first_error();
    float summed_error = 0.0;
    vec3 first_direction = ray_direction(s);
    int taken = 0;
    for (; taken < u_steps; ++taken) {
        if (absorbed(s)) break;
        h = min(h, longest_step(s));
        Step attempt = advance(s, h);
        bool stands = accepted(attempt.error);
        float next = adapted_step(h, attempt.error, error_before);
        if (stands) {
            s = attempt.state;
            tau += h;
            summed_error += attempt.error;
            error_before = attempt.error;
        }
        h = next;
        // A step that may not become smaller is marked by its sign; the termination pass ends the ray.
        if (!stands && h < u_smallest_step) {
            h = -h;
            break;
        }
        if (dot(ray_direction(s), first_direction) < u_chord_cosine) {
            ++taken;
            break;
        }
    }
    out_x = vec4(s.x, tau);
    out_v = vec4(s.v, h);
#ifdef EFFORT
    out_effort = texelFetch(u_effort, pixel, 0) + vec4(summed_error, float(taken), 0.0, 0.0);
#endif
#else
    float h = v.w * u_step_factor;
    int taken = 0;
    for (; taken < u_steps; ++taken) {
        if (absorbed(s)) break;
        s = advance(s, h).state;
    }
    out_x = vec4(s.x, x.w + float(taken) * h);
    out_v = vec4(s.v, v.w);
#endif
}
