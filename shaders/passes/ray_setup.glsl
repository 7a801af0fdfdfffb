// Ray setup, Section 3.1: the first point of every ray in phase space, in two textures.

void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction);  // where and which way pixel looks
vec3 chart_direction(vec3 x, vec3 direction);                      // the observer's direction, seen in the chart
RayState initial_state(vec3 x, vec3 d);                            // the model's state for it

uniform vec2 u_pixel_offset;  // of this tile's corner in the whole image, plus the sample's place in the pixel
uniform float u_step;

out vec4 out_x;  // x, tau
out vec4 out_v;  // v, step size h

void main() {
    vec3 origin, direction;
    camera_ray(gl_FragCoord.xy + u_pixel_offset, origin, direction);
    RayState s = initial_state(origin, chart_direction(origin, direction));
    out_x = vec4(s.x, 0.0);
    out_v = vec4(s.v, u_step);
}
