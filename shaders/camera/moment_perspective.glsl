// Provides ray_moment() of a pinhole far away. A pixel's direction differs by `off` from the one in which the observer
// sees the centre, whose moment is known in float64 (addon/core/aim.py). What is left to compute, origin x off, is as
// small as the moment itself, and is right to a few roundings of it.

vec3 change_at_rest(vec3 towards, vec3 off);   // the observer's
vec3 chart_vector(vec3 x, vec3 direction);     // of any length

uniform vec3 u_aim;         // where the centre is seen, model space; where the camera looks: on the plane at distance 1
uniform vec3 u_aim_offset;  // from there to the window's lower left corner, in the camera's axes
uniform vec3 u_aim_moment;  // of u_aim: what the chart's own twist leaves of it

vec3 ray_moment(vec2 pixel, vec3 origin, vec3 direction) {
    vec3 off = u_camera_axes * (u_aim_offset + vec3(pixel * u_window.zw, 0.0));
    vec3 moment = u_aim_moment + cross(origin, change_at_rest(u_aim, off));
    return moment / length(chart_vector(origin, u_aim + off));
}
