// Provides ray_moment() of a parallel projection from far away. A pixel's ray begins `off` from where the ray through the
// centre begins, whose moment is known in float64 (addon/core/aim.py). So off x direction is right to a few roundings.

vec3 chart_vector(vec3 x, vec3 direction);  // of any length

uniform vec3 u_aim;         // the rays' direction for an observer at rest, model space
uniform vec3 u_aim_offset;  // from where the ray through the centre begins to the window's lower left corner, camera's axes
uniform vec3 u_aim_moment;  // of the ray through the centre: what the chart's own twist leaves of it

vec3 ray_moment(vec2 pixel, vec3 origin, vec3 direction) {
    vec3 off = u_camera_axes * (u_aim_offset + vec3(pixel * u_window.zw, 0.0));
    return (u_aim_moment + cross(off, u_aim)) / length(chart_vector(origin, direction));
}
