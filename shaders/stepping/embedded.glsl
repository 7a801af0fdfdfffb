// Provides steps whose sizes are predicted from the integrator's own error estimate. One that errs by too much, or that
// leaves where the law has a value, does not stand and is tried again, shorter; so is one that goes past a border.

Step advance_from(RayState s, RayState first, float h, out RayState last);  // one step, and the derivatives at its ends
float time_left(float tau);      // until the model ends a ray that has met nothing
vec2 border_gap(RayState s, RayState rate);  // how far the border of the region is, and how fast that changes
bool finds_border(vec2 gap, vec2 gap_after, RayState after, RayState rate, float h, out float beyond);  // the end of a step
void move_back(inout RayState after, RayState first, inout RayState last, float beyond, float h);
float error_weight(RayState s, float h);  // what an error of a step from s counts
void add_error(inout Ray ray, RayState after, float error);  // of a step that stands
float longest_step(RayState s);  // so that no step can jump over what the model has at its centre
float chord_excess(RayState a, RayState b, float tau);  // how far the step strays from its chord, of what is allowed
bool accepted(float error);      // whether a step stands
float adapted_step(float h, float error, inout float demand);  // the next step size, from the last two estimates
float first_demand();            // what stands for the first of them at the beginning

uniform float u_first_reach;  // how far the first step may at least be tried, model lengths
uniform float u_smallest_step;

const float STRAIGHT_CHORD = 0.04;  // of what is allowed: below it a chord does not limit the next step

// Twenty steps to the bounding sphere, unless the user knows better: the error will tell.
float first_try(RayState rate) {
    return max(u_step, u_first_reach / max(length(rate.x), 1e-30));
}

void take_step(inout Ray ray) {
    float free = min(min(ray.h, longest_step(ray.state)), time_left(ray.tau));
    float h = min(free, ray.border_ahead);
    ++ray.taken;
    RayState rate_after;
    Step attempt = advance_from(ray.state, ray.rate, h, rate_after);
    float error = error_weight(ray.state, h) * attempt.error;
    bool is_state = finite(attempt.state.x) && finite(attempt.state.v);
    float demand = ray.demand;
    float next = adapted_step(h, is_state ? error : INFINITE, demand);
    // The sagitta grows with the square of the step. One step alone has to be a good enough chord.
    float excess = is_state ? chord_excess(ray.state, attempt.state, ray.tau + h) : 0.0;
    next = min(next, h * inversesqrt(max(excess, STRAIGHT_CHORD)));
    bool stands = is_state && accepted(error) && excess <= 1.5;
    bool too_small = next <= h && (!stands && next < u_smallest_step || stalls(ray.state, next));

    vec2 gap = border_gap(attempt.state, rate_after);
    float beyond;
    ray.at_border = finds_border(ray.gap, gap, attempt.state, rate_after, h, beyond) && stands;
    ray.border_ahead = NO_BORDER_AHEAD;
    if (ray.at_border) {
        move_back(attempt.state, ray.rate, rate_after, beyond, h);
        h -= beyond;
        next = first_try(rate_after);
        demand = first_demand();
        too_small = false;
    } else if (stands && beyond > 0.0) {  // as far as the border, once more
        stands = false;
        ray.border_ahead = h - beyond;
        next = free;
        demand = ray.demand;
        too_small = false;
    }
    if (stands) {
        add_error(ray, attempt.state, error);
        ray.state = attempt.state;
        ray.rate = rate_after;
        ray.gap = gap;
        ray.tau += h;
    } else {
        ++ray.rejected;
    }
    ray.h = next;
    ray.demand = demand;
    if (too_small) ray.status = STEP_TOO_SMALL;
}
