// Provides the cube texture of Section 4.3: light-emitting objects at infinity.

uniform samplerCube u_sky;
uniform mat3 u_world_from_model;  // the cube stands in world space

#ifdef FILTERED_SKY
vec3 filtered_sky(samplerCube sky, vec3 direction, Footprint footprint);

vec4 environment(vec3 direction, Footprint footprint) {
    footprint = Footprint(u_world_from_model * footprint.across, u_world_from_model * footprint.along);
    return vec4(filtered_sky(u_sky, u_world_from_model * direction, footprint), 1.0);
}
#else
vec4 environment(vec3 direction) {
    return vec4(texture(u_sky, u_world_from_model * direction).rgb, 1.0);
}
#endif
