// Leaves out: errors that a later step mends.

float error_weight(RayState s) {
    return 1.0;
}
