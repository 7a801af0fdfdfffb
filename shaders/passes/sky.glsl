// The sky box, Section 4.3, and the pixel's final colour: what a ray hit, or the environment in the ray's direction at
// the boundary, or black for an absorbed ray; rays that failed show the environment or a marker, as the user chose.

vec4 environment(vec3 direction);
#ifdef FAR_SKY
bool far_side(vec3 x);
vec4 far_environment(vec3 direction);

uniform sampler2D u_end_x;
#endif
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
    if (status == ABSORBED) out_color = vec4(0.0, 0.0, 0.0, 1.0);
#ifdef GEOMETRY
    else if (status == HIT) out_color = texelFetch(u_color, pixel, 0);
#endif
    else if (status > LEFT_DOMAIN && u_failed_color.a > 0.0) out_color = u_failed_color;
    else if (status == NOT_FINITE) out_color = vec4(0.0, 0.0, 0.0, 1.0);
#ifdef FAR_SKY
    else if (far_side(texelFetch(u_end_x, pixel, 0).xyz)) out_color = far_environment(v.xyz);
#endif
    else out_color = environment(v.xyz);
}
