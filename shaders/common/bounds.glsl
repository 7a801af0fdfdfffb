// Provides the bounding sphere of Section 4.1: it holds all objects and lies in almost flat space.

vec3 ray_direction(RayState s);

uniform float u_escape_radius;

bool outside(RayState s) {
    return dot(s.x, s.x) > u_escape_radius * u_escape_radius && dot(s.x, ray_direction(s)) > 0.0;
}
