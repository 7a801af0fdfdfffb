// Provides n(x) of a ball behind a spherical front: n = 1 + strength inside `radius`, 1 outside, a quintic between them
// of width `thickness` (a part of the radius). As the thickness falls this becomes Snell's law at the sphere.

uniform float u_radius;
uniform float u_strength;
uniform float u_thickness;

float time_to_ball(vec3 x, vec3 v, float radius);

vec4 medium(vec3 x) {
    float r = length(x);
    float width = u_thickness * u_radius;
    float t = clamp(0.5 - (r - u_radius) / width, 0.0, 1.0);
    float n = 1.0 + u_strength * t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    float slope = -30.0 * u_strength * t * t * (1.0 - t) * (1.0 - t) / width;
    return vec4(n * slope / max(r, 1e-30) * x, n * n);
}

bool absorbed(RayState s) {
    return false;
}

// As far as the front is, and a quarter of its thickness within it; through all of the space around it.
float longest_step(RayState s) {
    float width = u_thickness * u_radius;
    float inside = max(abs(length(s.x) - u_radius) - 0.5 * width, 0.25 * width) / max(length(s.v), 1e-30);
    return max(inside, time_to_ball(s.x, s.v, u_radius + 0.5 * width));
}
