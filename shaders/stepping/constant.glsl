// Provides steps of one size, but for those that end on a border.

Step advance_from(RayState s, RayState first, float h, out RayState last);  // one step, and the derivatives at its ends
float time_left(float tau);      // until the model ends a ray that has met nothing
vec2 border_gap(RayState s, RayState rate);  // how far the border of the region is, and how fast that changes
bool finds_border(vec2 gap, vec2 gap_after, RayState after, RayState rate, float h, out float beyond);  // the end of a step
void move_back(inout RayState after, RayState first, inout RayState last, float beyond, float h);
float leapt_over(RayState before, RayState after);  // the part of a step beyond a border that both its ends are outside of

float first_try(RayState rate) {
    return u_step;
}

float first_demand() {
    return 0.0;
}

void take_step(inout Ray ray) {
    float h = min(min(ray.h, time_left(ray.tau)), ray.border_ahead);
    RayState rate_after;
    RayState after = advance_from(ray.state, ray.rate, h, rate_after).state;
    ++ray.taken;
    if (!finite(after.x) || !finite(after.v)) {
        ray.status = NOT_FINITE;
        return;
    }
    vec2 gap = border_gap(after, rate_after);
    float beyond;
    ray.at_border = finds_border(ray.gap, gap, after, rate_after, h, beyond);
    if (!ray.at_border && beyond <= 0.0) beyond = leapt_over(ray.state, after) * h;
    ray.border_ahead = NO_BORDER_AHEAD;
    if (ray.at_border) move_back(after, ray.rate, rate_after, beyond, h);
    bool is_there = finite(after.x) && finite(after.v);  // or the force at the end is no measure of the way to the border
    if (!is_there || (!ray.at_border && beyond > 0.0)) {  // as far as the border, once more
        ray.at_border = false;
        ray.border_ahead = is_there ? h - beyond : 0.5 * h;
        return;
    }
    ray.state = after;
    ray.rate = rate_after;
    ray.gap = gap;
    ray.tau += ray.at_border ? h - beyond : h;
}
