// Ray setup, Section 3.1: the first point of every ray in phase space, in two textures.

void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction);  // where and which way pixel looks
vec3 chart_direction(vec3 x, vec3 direction);                      // the observer's direction, seen in the chart
RayState initial_state(vec3 x, vec3 d);                            // the model's state for it

uniform vec2 u_pixel_offset;  // of this tile's corner in the whole image, plus the sample's place in the pixel
uniform float u_step;
uniform float u_escape_radius;

out vec4 out_x;  // x, tau
out vec4 out_v;  // v, step size h

// How far a ray may go straight before anything can bend it or be hit: to the bounding sphere, or past it where the ray
// misses it. 0 for a ray that begins inside or leaves.
float straight_way(vec3 x, vec3 d) {
    float towards = -dot(x, d);
    float beyond = dot(x, x) - u_escape_radius * u_escape_radius;
    if (beyond <= 0.0 || towards <= 0.0) return 0.0;
    float under_root = towards * towards - beyond;
    return under_root > 0.0 ? towards - sqrt(under_root) : towards;
}

void main() {
    vec3 origin, direction;
    camera_ray(gl_FragCoord.xy + u_pixel_offset, origin, direction);
    vec3 d = chart_direction(origin, direction);
    float way = straight_way(origin, d);
    RayState s = initial_state(origin + way * d, d);
    out_x = vec4(s.x, way);
    out_v = vec4(s.v, u_step);
}
