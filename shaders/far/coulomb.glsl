// Provides what is left to turn of a hyperbola: around a single centre exactly, around several with their sum at their middle.
// With K the sum, p = K / r, w the speed at infinity, w^2 = v^2 - 2 p, and v_r, v_t the velocity along x and across it,
// Laplace's vector gives the angle from v to the asymptote,
//
//     sin = v_t p (v^2 - p - w v_r) / (v (p^2 + w^2 v_t^2)),
//
// whose difference is p^2 / (v^2 - p + w v) + w v_t^2 / (v + v_r), without cancellation. Source: Goldstein, Classical
// Mechanics, Section 3.9.

uniform vec3 u_middle;       // of the centres
uniform float u_whole_k;     // their sum, model lengths
uniform float u_quadrupole;  // how far from their middle they are at most, squared

vec4 bend_of_charge(vec3 x, vec3 d, float speed) {
    vec3 outward = x - u_middle;
    float r = max(length(outward), 1e-30);
    outward /= r;
    float pull = u_whole_k / r;
    float squared = speed * speed;
    if (squared <= 2.0 * pull) return vec4(0.0);  // bound: it has no asymptote
    float far_speed = sqrt(squared - 2.0 * pull);
    float along = dot(outward, d);
    vec3 aside = outward - along * d;
    float across = dot(aside, aside) * squared;
    float difference = pull * pull / (squared - pull + far_speed * speed)
        + far_speed * across / max((1.0 + along) * speed, 1e-30);
    vec3 sine = -pull * difference / max(pull * pull + far_speed * far_speed * across, 1e-37) * aside;
    return vec4(sine * inversesqrt(max(1.0 - dot(sine, sine), 1e-6)), abs(pull) * u_quadrupole / (r * r));
}

vec4 far_bend(RayState s, vec3 d) {
    return bend_of_charge(s.x, d, length(s.v));
}

vec3 far_turn(vec3 x, vec3 d) {
    return bend_of_charge(x, -d, 1.0).xyz;
}

float far_index(vec3 x, vec3 d) {
    return 1.0;
}
