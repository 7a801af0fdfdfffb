// Provides n(x) of a blast wave, in the spirit of Yngve, O'Brien and Hodgins 2000, but procedural as in the paper:
//
//     n = 1 + strength * inside(|y|) * front(y),   y = x / R,   R = radius * time^(2/5)
//     inside = (1 + rarefaction) |y|^4 - rarefaction:   thin air behind the compressed front
//     front = 1 within, 0 outside, a quintic of width `thickness` where |y| = 1 + roughness * noise(frequency * y)
//
// R is the Sedov-Taylor radius of a strong blast, and thickness and roughness are parts of it: n keeps its form as it grows.

vec4 noise(vec3 q, uint seed);  // gradient and value
float time_to_ball(vec3 x, vec3 v, float radius);

uniform float u_radius;
uniform float u_time;
uniform float u_strength;
uniform float u_thickness;
uniform float u_roughness;
uniform float u_frequency;
uniform float u_rarefaction;
uniform float u_seed;

const float NOISE_SLOPE = 11.2;  // |gradient of noise| < sqrt(3) * 15/8 * 2 * (4 + 4 + 4) / 7

float blast_radius() {
    return u_radius * max(pow(u_time, 0.4), 1e-6);
}

// Height above the rough front, and its gradient; both in units of R.
vec4 above_front(vec3 y) {
    vec4 rough = noise(u_frequency * y, uint(u_seed));
    float s = length(y);
    return vec4(y / s - u_roughness * u_frequency * rough.xyz, s - 1.0 - u_roughness * rough.w);
}

#ifdef ADAPTIVE
// At the place that medium() was last asked about. The fused loop asks longest_step() about the same one: where the ray
// is, or, behind a step that did not stand, where that one ended, and then the next step is shorter anyway.
float last_height = 0.0;

float height_above_front(vec3 y) {
    return last_height;
}
#else
float height_above_front(vec3 y) {
    return above_front(y).w;
}
#endif

vec4 medium(vec3 x) {
    float R = blast_radius();
    vec3 y = x / R;
    float s_squared = dot(y, y);
    float s = sqrt(s_squared);
    float reach = u_roughness + 0.5 * u_thickness;
    if (s >= 1.0 + reach) return vec4(0.0, 0.0, 0.0, 1.0);
    float front = 1.0;
    vec3 front_gradient = vec3(0.0);
    if (s > 1.0 - reach) {
        vec4 above = above_front(y);
#ifdef ADAPTIVE
        last_height = above.w;
#endif
        float t = clamp(0.5 - above.w / u_thickness, 0.0, 1.0);
        front = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
        front_gradient = -30.0 * t * t * (1.0 - t) * (1.0 - t) / u_thickness * above.xyz;
    }
    float inside = (1.0 + u_rarefaction) * s_squared * s_squared - u_rarefaction;
    vec3 inside_gradient = 4.0 * (1.0 + u_rarefaction) * s_squared * y;
    float n = 1.0 + u_strength * inside * front;
    vec3 gradient = u_strength / R * (front * inside_gradient + inside * front_gradient);
    return vec4(n * gradient, n * n);
}

bool absorbed(RayState s) {
    return false;
}

// As far as the front surely is, and half its thickness within it; through all of the space around it.
float longest_step(RayState s) {
    float R = blast_radius();
    vec3 y = s.x / R;
    float reach = u_roughness + 0.5 * u_thickness;
    float gap = abs(length(y) - 1.0) - reach;
    if (gap < 0.0) gap = (abs(height_above_front(y)) - 0.5 * u_thickness) / (1.0 + NOISE_SLOPE * u_roughness * u_frequency);
    float around = R * max(gap, 0.5 * u_thickness) / max(length(s.v), 1e-30);
    return max(around, time_to_ball(s.x, s.v, R * (1.0 + reach)));
}
