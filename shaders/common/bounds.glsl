// Provides the bounding sphere of Section 4.1: it holds all objects and lies in almost flat space. A chart of orbits has
// an outside() of its own.

vec3 ray_direction(RayState s);
#ifdef FAR_SIDE
RayState own_side(RayState s);  // the state in the chart of the side that it is on
#endif

uniform float u_escape_radius;

#ifndef ORBIT
bool outside(RayState s) {
#ifdef FAR_SIDE
    s = own_side(s);
#endif
    return dot(s.x, s.x) > u_escape_radius * u_escape_radius && dot(s.x, ray_direction(s)) > 0.0;
}
#endif

float bounding_radius() {
    return u_escape_radius;
}

// Gradient and value of a function that is positive within the sphere; a ray that has come to where it is 0 is outside.
vec4 bounds(vec3 x) {
    float r = length(x);
    return vec4(-x / max(r, 1e-30), 1.000002 * u_escape_radius - r);
}
