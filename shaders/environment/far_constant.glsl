// Provides a sky of one colour on the far side.

uniform vec3 u_far_sky_color;

vec4 far_environment(vec3 direction) {
    return vec4(u_far_sky_color, 1.0);
}
