// Provides the paper's step size control, Section 4.2: two thresholds, and the step doubles or halves.
// Euler's error over a segment grows with h to h squared, so a doubled step stays below the upper threshold.

uniform float u_tolerance;  // upper threshold, radians

const float LOWER_THRESHOLD = 0.2;  // as a part of the upper one

bool accepted(float error) {
    return finite(error) && error <= u_tolerance;
}

float next_step(float h, float error) {
    if (!accepted(error)) return 0.5 * h;
    return error < LOWER_THRESHOLD * u_tolerance ? 2.0 * h : h;
}
