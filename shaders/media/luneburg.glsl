// Provides n(x) of Luneburg's lens: n = sqrt(2 - r^2/R^2) within R, 1 outside. A parallel beam meets in a point of the rim.

uniform float u_radius;

float time_to_ball(vec3 x, vec3 v, float radius);

bool within = false;  // the region that is held

void hold(vec3 x) {
    within = dot(x, x) < u_radius * u_radius;
}

vec4 medium(vec3 x) {
    if (!within) return vec4(0.0, 0.0, 0.0, 1.0);
    float inverse = 1.0 / (u_radius * u_radius);
    return vec4(-inverse * x, 2.0 - inverse * dot(x, x));
}

vec4 border(vec3 x) {
    float r = length(x);
    vec4 outwards = vec4(x / max(r, 1e-30), r - u_radius);
    return within ? -outwards : outwards;
}

vec3 border_heart(vec3 x) {
    return vec3(0.0);
}

bool absorbed(RayState s) {
    return false;
}

// As far as the rim is, and half of the radius within it.
float longest_step(RayState s) {
    float radius = u_radius / max(length(s.v), 1e-30);
    return within ? 0.5 * radius : max(0.01 * radius, time_to_ball(s.x, s.v, u_radius));
}
