// Provides n(x) of Maxwell's fisheye: n = n0 / (1 + r^2/R^2). Its rays are circles, and all from x pass -R^2 x / |x|^2.

uniform float u_radius;
uniform float u_index;

vec4 medium(vec3 x) {
    float fall = 1.0 / (1.0 + dot(x, x) / (u_radius * u_radius));
    float n = u_index * fall;
    return vec4(-2.0 * n * n * fall / (u_radius * u_radius) * x, n * n);
}

bool absorbed(RayState s) {
    return false;
}

float longest_step(RayState s) {
    return 0.25 * max(length(s.x), u_radius) / max(length(s.v), 1e-30);
}
