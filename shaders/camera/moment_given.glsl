// Provides ray_moment() of given rays that begin far away: computed in float64 (addon/core/aim.py).

uniform sampler2D u_given_moments;

vec3 ray_moment(vec2 pixel, vec3 origin, vec3 direction) {
    return texelFetch(u_given_moments, ivec2(pixel), 0).xyz;
}
