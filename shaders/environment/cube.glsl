// Provides the cube texture of Section 4.3: light-emitting objects at infinity.

uniform samplerCube u_sky;
uniform mat3 u_world_from_model;  // the cube stands in world space

vec4 environment(vec3 direction) {
    return vec4(texture(u_sky, u_world_from_model * direction).rgb, 1.0);
}
