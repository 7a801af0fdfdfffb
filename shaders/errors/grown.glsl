// Provides the error of a ray's direction: what each step is estimated to be wrong by, and how that grows on the way after it:
// by e for each radian that the ray is turned. So it does on a photon orbit (Luminet 1979: each half turn, by exp(pi)); a
// law that bends a ray by little magnifies little, and one that focuses lets errors only swing, so that this is above them.
// float32 rounds what bends the ray in every step.

void add_error(inout Ray ray, RayState after, float error) {
    float turned = length(unit_or(after.v, vec3(0.0)) - unit_or(ray.state.v, vec3(0.0)));
    ray.error *= 1.0 + turned * (1.0 + 0.5 * turned);
    ray.error += error + (turned > 0.0 ? ROUNDING : 0.0);
}
