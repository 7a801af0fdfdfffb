// Provides the paper's discretisation of continuous refraction, Section 5.3 (after Yngve, O'Brien and Hodgins 2000): the
// ray is straight; when n has changed by more than a threshold, Snell's law gives the new direction, with the gradient
// of n as the surface's normal. |v| is the n of the last refraction, so that Snell's law reads: v along the surface stays.

vec4 medium(vec3 x);  // half the gradient of n^2, and n^2

uniform float u_threshold;  // relative change of n

const int HALVINGS = 20;  // to find a front that is thinner than the step

// The fraction of the step at which it refracts: the middle, unless n jumps in between and has no gradient there.
float refraction_point(RayState s, vec3 along, float n_squared_end) {
    float n_squared = medium(s.x).w;
    float change = n_squared_end - n_squared;
    vec3 gradient = medium(s.x + 0.5 * along).xyz;
    if (length(gradient) * length(along) >= 0.25 * abs(change)) return 0.5;
    float low = 0.0, high = 1.0;
    for (int i = 0; i < HALVINGS; ++i) {
        float middle = 0.5 * (low + high);
        if ((medium(s.x + middle * along).w - n_squared) / change > 0.5) high = middle;
        else low = middle;
    }
    return high;
}

// The velocity behind a surface with the unit normal towards higher n.
vec3 refracted(vec3 v, vec3 normal, float n_squared) {
    float across = dot(v, normal);
    vec3 tangential = v - across * normal;
    float under_root = n_squared - dot(tangential, tangential);
    if (under_root >= 0.0) return tangential + (across < 0.0 ? -1.0 : 1.0) * sqrt(under_root) * normal;
    // Total reflection, unless the ray already comes back from there.
    return across < 0.0 ? tangential - across * normal : v;
}

Step advance(RayState s, float h) {
    vec3 along = h * s.v;
    float n_squared = medium(s.x + along).w;
    float n_before = length(s.v);
    float n = sqrt(max(n_squared, 0.0));
    if (abs(n - n_before) <= u_threshold * n_before) return Step(RayState(s.x + along, s.v), 0.0);
    float fraction = refraction_point(s, along, n_squared);
    vec3 x = s.x + fraction * along;
    vec3 gradient = medium(x).xyz;
    float size = length(gradient);
    vec3 v = size > 0.0 ? refracted(s.v, gradient / size, n_squared) : s.v * (n / max(n_before, 1e-30));
    return Step(RayState(x + (1.0 - fraction) * h * v, v), 0.0);
}
