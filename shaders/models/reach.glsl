// Provides the end of a force that would go on for ever, so that a ray has a direction to look up the sky with:
// 1 inside, 0 outside, smooth between 0.8 and 1 of the reach.

float within_reach(float r, float reach) {
    float s = clamp((reach - r) / (0.2 * reach), 0.0, 1.0);
    return s * s * (3.0 - 2.0 * s);
}
