// "Compute New Stepsize", Section 4.2 and Figure 3: compares n steps of h with 2n steps of h/2.
// A segment whose two results differ by more than the upper threshold is taken back and tried with half the step,
// so that a ray which runs into a strong field cannot keep the error of its last long step. A segment is also a chord:
// where the method is better than the chord, the same is done for the chord's sagitta.

float next_step(float h, float error);  // the step size for the next segment
bool accepted(float error);             // whether this segment stands
bool absorbed(RayState s);
float longest_step(RayState s);         // so that no step can jump over what the model has at its centre
#ifdef CHORDS
float chord_excess(RayState a, RayState b, float tau);  // how far the ray strays from its chord, of what is allowed
#endif

uniform sampler2D u_x;  // the point before the segment
uniform sampler2D u_v;
uniform sampler2D u_full_x;  // after n steps of h
uniform sampler2D u_full_v;
uniform sampler2D u_half_x;  // after 2n steps of h/2
uniform sampler2D u_half_v;
uniform float u_smallest_step;
uniform int u_steps;  // n: steps of h a segment

out vec4 out_x;
out vec4 out_v;
#ifdef EFFORT
uniform sampler2D u_effort;
uniform float u_steps_a_segment;
out vec4 out_effort;  // summed error estimate, steps, those of them that did not stand
#endif

// The model's bound holds for one step; a segment of n of them may go twice as far and so never past the centre.
float longest_in_segment(RayState s) {
    return longest_step(s) * min(2.0 / float(u_steps), 1.0);
}

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 x = texelFetch(u_x, pixel, 0);
    vec4 v = texelFetch(u_v, pixel, 0);
    vec4 half_x = texelFetch(u_half_x, pixel, 0);
    RayState full = RayState(texelFetch(u_full_x, pixel, 0).xyz, texelFetch(u_full_v, pixel, 0).xyz);
    RayState half_steps = RayState(half_x.xyz, texelFetch(u_half_v, pixel, 0).xyz);

    RayState start = RayState(x.xyz, v.xyz);
    // Where both results lie in the absorbing region, how far they got in it means nothing.
    bool both_absorbed = absorbed(full) && absorbed(half_steps);
    float error = both_absorbed ? 0.0 : angular_error(start, half_steps, full.x - half_steps.x, full.v - half_steps.v);
    if (!finite(half_steps.x) || !finite(half_steps.v)) error = INFINITE;
    float h = next_step(v.w, error);
    bool stands = accepted(error) && v.w <= 1.001 * longest_in_segment(start);
#ifdef CHORDS
    float excess = chord_excess(start, half_steps, half_x.w);
    if (excess > 0.25) h = min(h, v.w);  // twice the way has four times the sagitta
    if (excess > 1.0) {
        h = min(h, 0.5 * v.w);
        stands = false;
    }
#endif
    // A step that may not become smaller is marked by its sign; the termination pass ends the ray.
    if (h <= v.w && (!stands && h < u_smallest_step || stalls(start, h))) h = -h;

    RayState s = start;
    if (stands) s = half_steps;
    out_x = vec4(s.x, stands ? half_x.w : x.w);
    out_v = vec4(s.v, min(h, longest_in_segment(s)));
#ifdef EFFORT
    out_effort = texelFetch(u_effort, pixel, 0) + vec4(stands ? error : 0.0, u_steps_a_segment, stands ? 0.0 : u_steps_a_segment, 0.0);
#endif
}
