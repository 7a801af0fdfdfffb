// Leaves out: the errors of rays.

float first_error(RayState start) {
    return 0.0;
}

void add_error(inout Ray ray, RayState after, float error) {
}
