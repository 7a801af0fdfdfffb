// Provides the cube texture of the far side's sky; its axes are those of the far chart, turned as the model is.

uniform samplerCube u_far_sky;
uniform mat3 u_far_world_from_model;

#ifdef FILTERED_FAR_SKY
vec3 filtered_sky(samplerCube sky, vec3 direction, Footprint footprint);

vec4 far_environment(vec3 direction, Footprint footprint) {
    footprint = Footprint(u_far_world_from_model * footprint.across, u_far_world_from_model * footprint.along);
    return vec4(filtered_sky(u_far_sky, u_far_world_from_model * direction, footprint), 1.0);
}
#else
vec4 far_environment(vec3 direction) {
    return vec4(texture(u_far_sky, u_far_world_from_model * direction).rgb, 1.0);
}
#endif
