// Provides a sky of one colour.

uniform vec3 u_sky_color;

vec4 environment(vec3 direction) {
    return vec4(u_sky_color, 1.0);
}
