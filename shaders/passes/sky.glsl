// The sky box, Section 4.3, and the pixel's final colour: what a ray hit, or the environment in the direction of v at
// the boundary, or black for an absorbed ray; rays that failed show the environment or a marker, as the user chose.

vec3 ray_direction(RayState s);
vec4 environment(vec3 direction);

uniform sampler2D u_end_x;
uniform sampler2D u_end_v;
#ifdef GEOMETRY
uniform sampler2D u_color;
#endif
uniform vec4 u_failed_color;  // alpha 0: the environment

out vec4 out_color;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 v = texelFetch(u_end_v, pixel, 0);
    float status = v.w;
    RayState s = RayState(texelFetch(u_end_x, pixel, 0).xyz, v.xyz);
    if (status == ABSORBED) out_color = vec4(0.0, 0.0, 0.0, 1.0);
#ifdef GEOMETRY
    else if (status == HIT) out_color = texelFetch(u_color, pixel, 0);
#endif
    else if (status > LEFT_DOMAIN && u_failed_color.a > 0.0) out_color = u_failed_color;
    else out_color = status == NOT_FINITE ? vec4(0.0, 0.0, 0.0, 1.0) : environment(ray_direction(s));
}
