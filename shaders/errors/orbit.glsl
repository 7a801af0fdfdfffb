// Provides the error of a ray's direction where it is integrated as an orbit (models/schwarzschild_orbit.glsl): what each
// step is estimated to be wrong by, and how that grows on the way after it. Binet's equation, linearised, is
//
//     d^2 s/dphi^2 = (6 M u - 1) s
//
// so that errors swing where 6 M u < 1, and grow by at most e for each radian up to the photon orbit, 3 M u = 1.

const float LARGEST_ERROR = 3.1415927;

// start : in space. Its place is rounded, and seen from where it passes the centre, that is an angle.
float first_error(RayState start) {
    vec3 moment = cross(start.x, unit_or(start.v, vec3(0.0)));
    return min(ROUNDING * dot(start.x, start.x) / max(length(start.x) * length(moment), 1e-30), LARGEST_ERROR);
}

void add_error(inout Ray ray, RayState after, float error) {
    float angle = 6.0 * u_mass * max(after.x.x, ray.state.x.x) > 1.0 ? abs(after.x.y - ray.state.x.y) : 0.0;
    ray.error *= 1.0 + angle * (1.0 + 0.5 * angle);
    ray.error += error + ROUNDING;
    ray.error = min(ray.error, LARGEST_ERROR);
}
