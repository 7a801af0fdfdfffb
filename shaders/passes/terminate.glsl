// Test for ray termination, Section 4.1. A ray that ends here is written down once, in textures of its own, and its
// depth becomes the 0 of this quad; a ray that goes on is discarded and keeps the depth 1 of the clear. Later quads of
// this pass fail the depth test at 0, so that the first ending stands.

bool absorbed(RayState s);
bool captured(RayState s);  // certain to be absorbed
bool outside(RayState s);  // the ray left the bounding sphere and cannot come back
float time_left(float tau);  // until the model ends a ray that has met nothing
vec3 ray_direction(RayState s);
#ifdef FAR_SIDE
RayState own_side(RayState s);  // the state in the chart of the side that it is on
#endif
#ifdef FROM_START
void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction);
uniform vec2 u_pixel_offset;
#endif
#ifdef DRIFT
float bounding_radius();
RayState ray_start(vec2 pixel, vec3 origin, vec3 direction, float radius, out float tau);  // at the bounding sphere
vec4 invariants(RayState s);  // what the model conserves
#endif
#ifdef FREQUENCY
float frequency_shift(vec3 x, vec3 direction);  // of light from infinity, seen by the observer
float clock_rate(vec3 x);                       // of a clock at rest, against one at infinity
#endif

uniform sampler2D u_x_before;
uniform sampler2D u_x;
uniform sampler2D u_v;
uniform float u_segment;
uniform bool u_last_segment;

out vec4 out_x;  // where it ended, tau
out vec4 out_v;  // unit direction there, status
#ifdef GEOMETRY
uniform sampler2D u_depth;
#endif
#ifdef COLOR
uniform sampler2D u_color;
out vec4 out_color;
#endif
#ifdef SURFACE_PASSES
uniform sampler2D u_surface;
out vec4 out_surface;
#endif
#ifdef TALLY
out vec4 out_tally;  // depth, steps, error estimate, drift of the invariants
#endif
#ifdef FREQUENCY
out vec4 out_frequency;  // seen, as a multiple of that emitted at rest; 0 where no light comes from
#endif
#ifdef REJECTED
out vec4 out_rejected;  // of the steps taken, those whose result did not stand
#endif
#ifdef EFFORT
uniform sampler2D u_effort;  // summed error estimate, steps, those of them that did not stand
#else
uniform float u_steps_taken;
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 x = texelFetch(u_x, pixel, 0);
    vec4 v = texelFetch(u_v, pixel, 0);
    RayState s = RayState(x.xyz, v.xyz);
    float status = RUNNING;
    if (!finite(s.x) || !finite(s.v)) status = NOT_FINITE;
    else if (absorbed(s)) status = ABSORBED;
    else if (outside(s)) status = ESCAPED;
    else if (time_left(x.w) <= 0.0) status = LEFT_DOMAIN;
    else if (v.w <= 0.0) status = captured(s) ? ABSORBED : STEP_TOO_SMALL;
    else if (u_last_segment) status = captured(s) ? ABSORBED : STEP_LIMIT;

    vec4 before = texelFetch(u_x_before, pixel, 0);
#ifdef GEOMETRY
    vec2 found = texelFetch(u_depth, pixel, 0).xy;
    float depth = found.x;
    if (depth < NO_HIT) {
        x = mix(before, x, found.y);
        status = absorbed(RayState(x.xyz, v.xyz)) ? ABSORBED : HIT;  // a long chord may go through a horizon
    }
#else
    float depth = u_segment + 1.0;
#endif
    if (status == RUNNING) discard;
    if (status == NOT_FINITE) {  // the last point that was still a number
        x = before;
        out_v = vec4(0.0, 0.0, 0.0, status);
    } else {
#ifdef FAR_SIDE
        out_v = vec4(ray_direction(own_side(s)), status);
#else
        out_v = vec4(ray_direction(s), status);
#endif
    }
    out_x = x;
#ifdef COLOR
    out_color = texelFetch(u_color, pixel, 0);
#endif
#ifdef SURFACE_PASSES
    out_surface = status == HIT ? texelFetch(u_surface, pixel, 0) : vec4(0.0);
#endif
#ifdef FROM_START
    vec3 origin, direction;
    vec2 place = gl_FragCoord.xy + u_pixel_offset;
    camera_ray(place, origin, direction);
#endif
#ifdef FREQUENCY
    float shift = status == ABSORBED || status == NOT_FINITE ? 0.0 : frequency_shift(origin, direction);
    if (status == HIT) shift *= clock_rate(x.xyz);
    out_frequency = vec4(shift);
#endif
#ifdef REJECTED
    out_rejected = vec4(texelFetch(u_effort, pixel, 0).z);
#endif
#ifdef TALLY
    float drift = 0.0;
#ifdef EFFORT
    vec2 effort = texelFetch(u_effort, pixel, 0).xy;
#else
    vec2 effort = vec2(0.0, u_steps_taken);
#endif
#ifdef DRIFT
    float to_first;
    vec4 first = invariants(ray_start(place, origin, direction, bounding_radius(), to_first));
    vec4 change = abs(invariants(s) - first);
    vec4 size = abs(first);
    drift = max(max(change.x, change.y), max(change.z, change.w))
        / max(max(max(size.x, size.y), max(size.z, size.w)), 1e-30);
    if (!finite(drift)) drift = 3.0e38;
#endif
    out_tally = vec4(min(depth, u_segment + 1.0), effort.y, effort.x, drift);
#endif
}
