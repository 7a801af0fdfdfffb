// Leaves out: borders of the law.

void hold(vec3 x) {
}

vec2 border_gap(RayState s, RayState rate) {
    return vec2(1.0, 0.0);
}

bool finds_border(vec2 gap, vec2 gap_after, RayState after, RayState rate, float h, out float beyond) {
    beyond = 0.0;
    return false;
}

float leapt_over(RayState before, RayState after) {
    return 0.0;
}

void move_back(inout RayState after, RayState first, inout RayState last, float beyond, float h) {
}

void cross_border(inout RayState s, inout RayState rate) {
}
