// Provides n(x) of a ball behind a spherical front: n = 1 + strength inside `radius`, 1 outside, a quintic between them
// of width `thickness` (a part of the radius). As the thickness falls this becomes Snell's law at the sphere, and a front
// for which float32 has no digits left is the sphere itself.

uniform float u_radius;
uniform float u_strength;
uniform float u_thickness;

float time_to_ball(vec3 x, vec3 v, float radius);

const float NO_WIDTH = 2.0e-5;  // thickness below which n jumps
const float THIN = 0.1;         // thickness below which the steps' errors in the front are mended at its end

// Regions
const int OUTSIDE = 0;
const int FRONT = 1;
const int WITHIN = 2;
int region = OUTSIDE;  // the one that is held

float half_width() {
    return u_thickness < NO_WIDTH ? 0.0 : 0.5 * u_thickness * u_radius;
}

void hold(vec3 x) {
    float height = length(x) - u_radius;
    region = height >= half_width() ? OUTSIDE : height <= -half_width() ? WITHIN : FRONT;
}

bool settles() {
    return half_width() == 0.0 || (region == FRONT && u_thickness < THIN);
}

float front_thickness() {
    return u_thickness;
}

float front_width() {
    return u_thickness * u_radius;
}

vec3 front_direction(vec3 x) {
    return x;
}

vec4 border(vec3 x) {
    float r = length(x);
    float height = r - u_radius;
    float sense = region == OUTSIDE || (region == FRONT && height < 0.0) ? 1.0 : -1.0;
    return vec4(sense / max(r, 1e-30) * x, sense * height + (region == FRONT ? half_width() : -half_width()));
}

vec3 border_heart(vec3 x) {
    return vec3(0.0);
}

vec4 medium(vec3 x) {
    float r = length(x);
    float width = u_thickness * u_radius;
    float t = region == FRONT ? 0.5 - (r - u_radius) / width : region == WITHIN ? 1.0 : 0.0;
    float n = 1.0 + u_strength * t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    float slope = -30.0 * u_strength * t * t * (1.0 - t) * (1.0 - t) / width;
    return vec4(n * slope / max(r, 1e-30) * x, n * n);
}

bool absorbed(RayState s) {
    return false;
}

// To the front; half of the radius within it; in it, half of its width, along which a ray at a slant goes farther.
float longest_step(RayState s) {
    float speed = max(length(s.v), 1e-30);
    if (region == OUTSIDE) return max(0.01 * u_radius / speed, time_to_ball(s.x, s.v, u_radius + half_width()));
    if (region == WITHIN) return 0.5 * u_radius / speed;
    float straight = abs(dot(s.x, s.v)) / max(length(s.x), 1e-30);
    return half_width() / max(straight, sqrt(u_thickness) * speed);
}
