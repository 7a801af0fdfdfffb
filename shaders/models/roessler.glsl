// Provides the Roessler system, paper Section 5.1; Roessler 1976:
//
//     field(x) = (-(x + z), x + alpha y, beta + z (x - gamma))
//
// models/dynamics.glsl makes a force or a flow of it, and describes the state.

uniform float u_alpha;
uniform float u_beta;
uniform float u_gamma;
uniform float u_strength;        // force mode
uniform float u_reach;           // force mode, model lengths
uniform float u_plane_distance;  // flow mode, model lengths
uniform float u_duration;        // flow mode, tau

vec3 field(vec3 x) {
    return vec3(-(x.x + x.z), x.x + u_alpha * x.y, u_beta + x.z * (x.x - u_gamma));
}

vec3 field_change(vec3 x, vec3 along) {
    return vec3(
        -(along.x + along.z),
        along.x + u_alpha * along.y,
        x.z * along.x + (x.x - u_gamma) * along.z);
}
