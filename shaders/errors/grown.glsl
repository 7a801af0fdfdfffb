// Provides the error of a ray's direction: what each step is estimated to be wrong by, and how that grows on the way after it:
// by e for each radian that the ray is turned. So it does on a photon orbit (Luminet 1979: each half turn, by exp(pi)); a
// law that bends a ray by little magnifies little, and one that focuses lets errors only swing, so that this is above them.
// float32 rounds what bends the ray in every step, and where that is: next to something that bends the ray around it, the
// rounding of a place is an angle, the larger, the farther from the origin the place is.

const float LARGEST_ERROR = 3.1415927;
const float PLACES = 6.0;  // that a step rounds, of one size and sign: stages and its end

// start : in space. Its place is rounded, and seen from where it passes the centre, that is an angle.
float first_error(RayState start) {
    vec3 moment = cross(start.x, unit_or(start.v, vec3(0.0)));
    return min(ROUNDING * dot(start.x, start.x) / max(length(start.x) * length(moment), 1e-30), LARGEST_ERROR);
}

void add_error(inout Ray ray, RayState after, float error) {
    float turned = length(unit_or(after.v, vec3(0.0)) - unit_or(ray.state.v, vec3(0.0)));
    ray.error *= 1.0 + turned * (1.0 + 0.5 * turned);
    float way = max(length(after.x - ray.state.x), 1e-30);
    float place = length(after.x) * turned / way;  // from the origin, in radii of the ray's curve
    ray.error += error + (turned > 0.0 ? ROUNDING * (1.0 + PLACES * place * turned) : 0.0);
    ray.error = min(ray.error, LARGEST_ERROR);
}
