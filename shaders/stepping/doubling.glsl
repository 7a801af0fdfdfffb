// Provides the paper's step size control, Section 4.2: n steps of h against 2n steps of h / 2.

Step advance_from(RayState s, RayState first, float h, out RayState last);  // one step, and the derivatives at its ends
float time_left(float tau);      // until the model ends a ray that has met nothing
vec2 border_gap(RayState s, RayState rate);  // how far the border of the region is, and how fast that changes
bool finds_border(vec2 gap, vec2 gap_after, RayState after, RayState rate, float h, out float beyond);  // the end of a step
void move_back(inout RayState after, RayState first, inout RayState last, float beyond, float h);
float error_weight(RayState s, float h);  // what an error of a step from s counts
void add_error(inout Ray ray, RayState after, float error);  // of a step that stands
float longest_step(RayState s);         // so that no step can jump over what the model has at its centre
bool absorbed(RayState s);
bool accepted(float error);             // whether the steps stand
float next_step(float h, float error);  // the next step size

uniform int u_steps;  // n
uniform float u_smallest_step;

float first_try(RayState rate) {
    return u_step;
}

float first_demand() {
    return 0.0;
}

void take_step(inout Ray ray) {
    float n = float(u_steps);
    float free = min(min(ray.h, longest_step(ray.state) / n), time_left(ray.tau) / n);
    float h = min(free, ray.border_ahead / n);
    ray.taken += 3 * u_steps;
    RayState whole = ray.state, halves = ray.state, rate = ray.rate, rate_after = ray.rate;
    for (int i = 0; i < u_steps; ++i) whole = advance_from(whole, rate, h, rate).state;
    for (int i = 0; i < 2 * u_steps; ++i) halves = advance_from(halves, rate_after, 0.5 * h, rate_after).state;
    // Where both results lie in the absorbing region, how far they got in it means nothing.
    bool both_absorbed = absorbed(whole) && absorbed(halves);
    float error = both_absorbed ? 0.0 : angular_error(ray.state, halves, whole.x - halves.x, whole.v - halves.v);
    error *= error_weight(ray.state, n * h);
    bool stands = finite(halves.x) && finite(halves.v) && accepted(error);
    float next = stands ? next_step(h, error) : 0.5 * h;
    bool too_small = next <= h && (!stands && next < u_smallest_step || stalls(ray.state, next));

    vec2 gap = border_gap(halves, rate_after);
    float beyond;
    ray.at_border = finds_border(ray.gap, gap, halves, rate_after, n * h, beyond) && stands;
    ray.border_ahead = NO_BORDER_AHEAD;
    float went = n * h;
    if (ray.at_border) {
        move_back(halves, ray.rate, rate_after, beyond, went);
        went -= beyond;
        next = first_try(rate_after);
        too_small = false;
    } else if (stands && beyond > 0.0) {  // as far as the border, once more
        stands = false;
        ray.border_ahead = went - beyond;
        next = free;
        too_small = false;
    }
    if (stands) {
        add_error(ray, halves, error);
        ray.state = halves;
        ray.rate = rate_after;
        ray.gap = gap;
        ray.tau += went;
    } else {
        ray.rejected += 3.0 * n;
    }
    ray.h = next;
    if (too_small) ray.status = STEP_TOO_SMALL;
}
