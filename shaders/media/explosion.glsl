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

const float NO_WIDTH = 2.0e-5;  // thickness below which n jumps
const float THIN = 0.1;         // thickness below which the steps' errors in the front are mended at its end
const float FOLD = 0.16;

// Regions
const int OUTSIDE = 0;
const int FRONT = 1;
const int WITHIN = 2;
int region = OUTSIDE;  // the one that is held

float half_width() {
    return u_thickness < NO_WIDTH ? 0.0 : 0.5 * u_thickness;
}

float blast_radius() {
    return u_radius * max(pow(u_time, 0.4), 1e-6);
}

// Height above the rough front, and its gradient; both in units of R.
vec4 above_front(vec3 y) {
    vec4 rough = noise(u_frequency * y, uint(u_seed));
    float s = length(y);
    return vec4(y / s - u_roughness * u_frequency * rough.xyz, s - 1.0 - u_roughness * rough.w);
}

// How far the front reaches from |y| = 1, with its noise and its width.
float front_reach() {
    return u_roughness + half_width();
}

// Height above the front where it may be near, and otherwise above the smooth sphere, with its gradient.
vec4 height_above(vec3 y) {
    float s = length(y);
    if (abs(s - 1.0) > front_reach()) return vec4(y / max(s, 1e-30), s - 1.0);
    return above_front(y);
}

void hold(vec3 x) {
    float height = height_above(x / blast_radius()).w;
    region = height >= half_width() ? OUTSIDE : height <= -half_width() ? WITHIN : FRONT;
}

bool settles() {
    return half_width() == 0.0 || (region == FRONT && u_thickness < THIN);
}

vec4 last_above = vec4(0.0);  // height_above() where border() was last asked: at the end of the last step

float front_thickness() {
    return u_thickness;
}

float front_width() {
    return u_thickness * blast_radius();
}

vec3 front_direction(vec3 x) {
    return last_above.xyz;
}

vec4 border(vec3 x) {
    float R = blast_radius();
    vec4 above = height_above(x / R);
    last_above = above;
    float sense = region == OUTSIDE || (region == FRONT && above.w < 0.0) ? 1.0 : -1.0;
    return vec4(sense / R * above.xyz, sense * above.w + (region == FRONT ? half_width() : -half_width()));
}

vec3 border_heart(vec3 x) {
    return vec3(0.0);
}

vec4 medium(vec3 x) {
    if (region == OUTSIDE) return vec4(0.0, 0.0, 0.0, 1.0);
    float R = blast_radius();
    vec3 y = x / R;
    float s_squared = dot(y, y);
    float front = 1.0;
    vec3 front_gradient = vec3(0.0);
    if (region == FRONT) {
        vec4 above = above_front(y);
        float t = 0.5 - above.w / u_thickness;
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

// As far as the front surely is, and half its thickness within it; through all of the space around it. The end of a step
// that meets the front is found, but not a fold of it that the step goes through and leaves again: none is smaller than
// FOLD of the noise's waves.
float longest_step(RayState s) {
    float R = blast_radius();
    float height = length(s.x) / R - 1.0;
    float gap = abs(height) - front_reach();
    if (gap < 0.0) gap = (abs(last_above.w) - half_width()) / (1.0 + NOISE_SLOPE * u_roughness * u_frequency);
    float least = region == FRONT ? half_width() : FOLD / (1.0 + u_frequency);
    float around = R * max(gap, least) / max(length(s.v), 1e-30);
    return max(around, time_to_ball(s.x, s.v, R * (1.0 + front_reach())));
}
