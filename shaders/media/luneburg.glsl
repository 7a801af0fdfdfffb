// Provides n(x) of Luneburg's lens: n = sqrt(2 - r^2/R^2) within R, 1 outside. A parallel beam meets in a point of the rim.

uniform float u_radius;

float time_to_ball(vec3 x, vec3 v, float radius);

vec4 medium(vec3 x) {
    float s_squared = dot(x, x) / (u_radius * u_radius);
    if (s_squared >= 1.0) return vec4(0.0, 0.0, 0.0, 1.0);
    return vec4(-x / (u_radius * u_radius), 2.0 - s_squared);
}

bool absorbed(RayState s) {
    return false;
}

// As far as the rim is, and a tenth of the radius within it.
float longest_step(RayState s) {
    return max(0.1 * u_radius / max(length(s.v), 1e-30), time_to_ball(s.x, s.v, u_radius));
}
