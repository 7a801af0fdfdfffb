// Leaves out: the errors of rays.

void add_error(inout Ray ray, RayState after, float error) {
}
