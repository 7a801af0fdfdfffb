// Provides n(x) with a linear square, n^2 = n0^2 + g z: rays are exact parabolas. There is no light where n^2 <= 0.

uniform float u_index;
uniform float u_gradient;

vec4 medium(vec3 x) {
    return vec4(0.0, 0.0, 0.5 * u_gradient, u_index * u_index + u_gradient * x.z);
}

bool absorbed(RayState s) {
    return medium(s.x).w <= 0.0;
}

// A turn of a tenth: any method of second order is exact on a parabola, but a chord is not.
float longest_step(RayState s) {
    return 0.2 * length(s.v) / max(abs(u_gradient), 1e-30);
}
