// Provides the Lorenz system, paper Section 5.1; Lorenz 1963:
//
//     field(x) = (sigma (y - x), rho x - y - x z, x y - beta z)
//
// models/dynamics.glsl makes a force or a flow of it, and describes the state.

uniform float u_sigma;
uniform float u_rho;
uniform float u_beta;
uniform float u_strength;        // force mode
uniform float u_reach;           // force mode, model lengths
uniform float u_plane_distance;  // flow mode, model lengths
uniform float u_duration;        // flow mode, tau

vec3 field(vec3 x) {
    return vec3(u_sigma * (x.y - x.x), x.x * (u_rho - x.z) - x.y, x.x * x.y - u_beta * x.z);
}

vec3 field_change(vec3 x, vec3 along) {
    return vec3(
        u_sigma * (along.y - along.x),
        (u_rho - x.z) * along.x - along.y - x.x * along.z,
        x.y * along.x + x.x * along.y - u_beta * along.z);
}
