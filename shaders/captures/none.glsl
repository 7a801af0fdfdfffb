// Leaves out: light that is certain to be absorbed before it is.

bool captured(RayState s) {
    return false;
}
