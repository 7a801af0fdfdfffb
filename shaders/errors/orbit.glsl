// Provides the error of a ray's direction where it is integrated as an orbit (models/schwarzschild_orbit.glsl): what each
// step is estimated to be wrong by, and how that grows on the way after it. Binet's equation, linearised, is
//
//     d^2 s/dphi^2 = (6 M u - 1) s
//
// so that errors swing where 6 M u < 1, and grow by at most e for each radian up to the photon orbit, 3 M u = 1.

void add_error(inout Ray ray, RayState after, float error) {
    float angle = 6.0 * u_mass * max(after.x.x, ray.state.x.x) > 1.0 ? abs(after.x.y - ray.state.x.y) : 0.0;
    ray.error *= 1.0 + angle * (1.0 + 0.5 * angle);
    ray.error += error + ROUNDING;
}
