// Provides camera_ray() for rays that come as two textures instead of from a camera: trace_rays() uses it.

uniform sampler2D u_given_origins;
uniform sampler2D u_given_directions;

void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction) {
    origin = texelFetch(u_given_origins, ivec2(pixel), 0).xyz;
    direction = normalize(texelFetch(u_given_directions, ivec2(pixel), 0).xyz);
}
