// Ray integration, Section 3.2: up to u_steps steps of the ODE, then one chord is handed to the intersection.
// With constant steps it is drawn with (n, h); step doubling draws it with (n, h) and with (2n, h/2). Where the method
// estimates its own error, every single step adapts, and the chord ends early where the ray strays too far from it.

bool absorbed(RayState s);   // the model swallowed the ray
float time_left(float tau);  // until the model ends a ray that has met nothing
void hold(vec3 x);           // the law's formula in the region that x is in
#ifdef EMBEDDED
bool outside(RayState s);    // the ray left the bounding sphere and cannot come back
RayState rhs(RayState s);
void take_step(inout Ray ray);  // one step, or an attempt that does not stand
float first_demand();
vec2 border_gap(RayState s, RayState rate);                // how far the region's border is, and how fast that changes
void cross_border(inout RayState s, inout RayState rate);  // into the region on the other side
float chord_excess(RayState a, RayState b, float tau);     // how far the ray strays from its chord, of what is allowed
#else
RayState advanced(RayState s, float h);  // one step of the integrator
#endif

uniform sampler2D u_x;  // x, tau
uniform sampler2D u_v;  // v, h
uniform int u_steps;
uniform float u_step_factor;
uniform float u_step;

out vec4 out_x;
out vec4 out_v;
#ifdef EFFORT
uniform sampler2D u_effort;
out vec4 out_effort;  // summed error estimate, steps, those of them that did not stand
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 x = texelFetch(u_x, pixel, 0);
    vec4 v = texelFetch(u_v, pixel, 0);
    RayState s = RayState(x.xyz, v.xyz);
    hold(s.x);
#ifdef EMBEDDED
    Ray ray;
    ray.state = s;
    ray.rate = rhs(s);
    ray.tau = x.w;
    ray.h = v.w;
    ray.demand = first_demand();
#ifdef EFFORT
    vec4 effort = texelFetch(u_effort, pixel, 0);
    ray.error = effort.x;
#else
    ray.error = 0.0;
#endif
    ray.status = RUNNING;
    ray.taken = 0;
    ray.rejected = 0.0;
    ray.gap = border_gap(ray.state, ray.rate);
    ray.border_ahead = NO_BORDER_AHEAD;
    ray.at_border = false;
    while (ray.taken < u_steps && ray.status == RUNNING && !ray.at_border && !absorbed(ray.state)
        && !outside(ray.state) && time_left(ray.tau) > 0.0) {
        take_step(ray);
        // With as much way again its sagitta would be four times as large.
        if (ray.border_ahead == NO_BORDER_AHEAD && chord_excess(s, ray.state, ray.tau) > 0.25) break;
    }
    if (ray.at_border) cross_border(ray.state, ray.rate);
    out_x = vec4(ray.state.x, ray.tau);
    // A step that may not become smaller is marked by its sign; the termination pass ends the ray.
    out_v = vec4(ray.state.v, ray.status == STEP_TOO_SMALL ? -ray.h : ray.h);
#ifdef EFFORT
    out_effort = vec4(ray.error, effort.y + float(ray.taken), effort.z + ray.rejected, 0.0);
#endif
#else
    float h = min(v.w * u_step_factor, time_left(x.w) / float(u_steps));
    int taken = 0;
    for (; taken < u_steps; ++taken) {
        if (absorbed(s)) break;
        s = advanced(s, h);
    }
    out_x = vec4(s.x, x.w + float(taken) * h);
    out_v = vec4(s.v, v.w);
#endif
}
