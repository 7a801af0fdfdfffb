// Provides the border of a singular force: the core of the nearest centre, on which a ray is absorbed.

uniform float u_core_radius;  // model lengths

vec3 nearest_centre(vec3 x);
float nearest(vec3 x);

vec4 border(vec3 x) {
    vec3 outward = x - nearest_centre(x);
    float r = length(outward);
    return vec4(outward / max(r, 1e-30), r - u_core_radius);
}

vec3 border_heart(vec3 x) {
    return nearest_centre(x);
}

const float ABSORBING = 1.0 + 1.0e-5;  // in core radii: a ray that has come to the border is absorbed

bool absorbed(RayState s) {
    return nearest(s.x) < ABSORBING * u_core_radius;
}
