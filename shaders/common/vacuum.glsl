// Provides how long a ray stays in the empty space around a ball that holds all that bends it.

const float BEYOND = 4.0;  // radii: out of most scenes, but not out of all bounds

// tau until a straight ray enters the ball of this radius around the centre: 0 within it. Where it leaves or misses, the
// time for BEYOND.
float time_to_ball(vec3 x, vec3 v, float radius) {
    float inverse = 1.0 / max(dot(v, v), 1e-37);
    float nearest = -dot(x, v) * inverse;
    vec3 closest = x + nearest * v;
    float under_root = radius * radius - dot(closest, closest);
    if (dot(x, x) <= radius * radius) return 0.0;
    bool enters = nearest > 0.0 && under_root > 0.0;
    return enters ? max(nearest - sqrt(under_root * inverse), 0.0) : BEYOND * radius * sqrt(inverse);
}
