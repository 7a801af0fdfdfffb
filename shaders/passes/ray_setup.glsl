// Ray setup, Section 3.1: the first point of every ray in phase space, in two textures.

void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction);  // where and which way pixel looks
RayState ray_start(vec2 pixel, vec3 origin, vec3 direction, float radius, out float tau);  // at the bounding sphere, if outside it
float bounding_radius();

uniform vec2 u_pixel_offset;  // of this tile's corner in the whole image, plus the sample's place in the pixel
uniform float u_step;

out vec4 out_x;  // x, tau
out vec4 out_v;  // v, step size h

void main() {
    vec3 origin, direction;
    vec2 pixel = gl_FragCoord.xy + u_pixel_offset;
    camera_ray(pixel, origin, direction);
    float tau;
    RayState s = ray_start(pixel, origin, direction, bounding_radius(), tau);
    out_x = vec4(s.x, tau);
    out_v = vec4(s.v, u_step);
}
