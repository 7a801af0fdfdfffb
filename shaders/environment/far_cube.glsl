// Provides the cube texture of the far side's sky; its axes are those of the far chart, turned as the model is.

uniform samplerCube u_far_sky;
uniform mat3 u_far_world_from_model;

vec4 far_environment(vec3 direction) {
    return vec4(texture(u_far_sky, u_far_world_from_model * direction).rgb, 1.0);
}
