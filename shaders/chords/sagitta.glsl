// Provides how far the ray from a to b strays from its chord, a fraction of what is allowed: an angle, seen from the
// camera, tau of way from b. It grows with the square of the way.

vec3 ray_direction(RayState s);  // unit: the way the ray goes

uniform float u_chord_tolerance;  // radians

float chord_excess(RayState a, RayState b, float tau) {
    float sagitta = 0.125 * length(b.x - a.x) * length(ray_direction(b) - ray_direction(a));
    return sagitta / (u_chord_tolerance * max(tau * length(b.v), 1e-30));
}
