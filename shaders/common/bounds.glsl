// Provides the bounding sphere of Section 4.1: it holds all objects and lies in almost flat space.

uniform float u_escape_radius;

bool outside(RayState s) {
    return dot(s.x, s.x) > u_escape_radius * u_escape_radius && dot(s.x, s.v) > 0.0;
}
