// Provides the same light by Binet's equation, where nothing but its end is asked for. An orbit lies in a plane; with
// u = 1/r, its angle phi from where it begins, and d tau = r^2 d psi, the force form (schwarzschild.glsl) is
//
//     d^2u/dpsi^2 = h^2 (3 M u^2 - u),   dphi/dpsi = h,   du/dpsi = w = -dr/dtau
//
// without a root or a quotient, regular at u = 0 (infinity) and for h = 0 (radial rays); a step may be a radian of phi.
// The state is x = (u, phi, -), v = (w, h, Q), with Q, the integral of h^2 u d psi, for tau alone: as
// d(x.v)/dtau = E^2 - M h^2 u^3 in space,
//
//     tau = (change of x.v + M Q) / E^2,   x.v = -w / u,   E^2 = w^2 + h^2 u^2 (1 - 2 M u)
//
// Its direction in the plane is -w outwards and h u around. Source: Chandrasekhar, The Mathematical Theory of Black
// Holes (1983), Section 20.

float bounding_radius();

const float FIRST_ANGLE = 0.5;    // radians of phi, the first step that is tried: the error will tell
const float LONGEST_ANGLE = 1.5;  // the same, of a step inwards
const float FARTHEST_END = 2.0;   // bounding radii, where the last step is to end at most
const float SMALLEST_RADIUS = 1e-18;  // so that float32 can square u

// The orbit's plane: e_r, where the ray begins, and e_phi, which way it goes around; and h. A radial ray, which without a
// mass would go through u = infinity, passes by the centre in some plane, as near as its direction's rounding.
void orbit_plane(RayState start, out vec3 e_r, out vec3 e_phi, out float h) {
    float r = max(length(start.x), SMALLEST_RADIUS);
    e_r = r > SMALLEST_RADIUS ? start.x / r : normalize(start.v);  // at the centre, it leaves
    vec3 axis = cross(e_r, start.v);
    float least = ROUNDING * length(start.v);
    if (dot(axis, axis) < least * least) {
        axis = least * normalize(cross(e_r, abs(e_r.z) < 0.5 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0)));
    }
    e_phi = normalize(cross(axis, e_r));
    h = r * length(axis);
}

// start : the ray's first state in space
RayState orbit_state(RayState start) {
    vec3 e_r, e_phi;
    float h;
    orbit_plane(start, e_r, e_phi, h);
    return RayState(vec3(1.0 / max(length(start.x), SMALLEST_RADIUS), 0.0, 0.0), vec3(-dot(start.v, e_r), h, 0.0));
}

float energy_squared(RayState s) {
    float across = s.v.y * s.x.x;
    return s.v.x * s.v.x + across * across * (1.0 - 2.0 * u_mass * s.x.x);
}

// The state in space behind a step, and tau from the ray's start on.  start : as orbit_state() has it
RayState space_state(RayState s, RayState start, out float tau) {
    vec3 e_r, e_phi;
    float h;
    orbit_plane(start, e_r, e_phi, h);
    float cosine = cos(s.x.y), sine = sin(s.x.y);
    vec3 outward = cosine * e_r + sine * e_phi;
    vec3 around = cosine * e_phi - sine * e_r;
    // An orbit's error must not put it behind infinity.
    float r = 1.0 / max(s.x.x, 0.5 * min(1.0 / (FARTHEST_END * bounding_radius()), 1.0 / length(start.x)));
    tau = (-s.v.x * r - dot(start.x, start.v) + u_mass * s.v.z) / max(energy_squared(s), 1e-30);
    return RayState(r * outward, -s.v.x * outward + s.v.y * s.x.x * around);
}

vec3 acceleration(vec3 x, RayState s) {
    float h_squared = s.v.y * s.v.y;
    return vec3(h_squared * (3.0 * u_mass * x.x - 1.0) * x.x, 0.0, h_squared * x.x);
}

RayState rhs(RayState s) {
    return RayState(s.v, acceleration(s.x, s));
}

// At the horizon, or on the way there: no light that goes inwards within the photon sphere, r = 3 M, comes back.
bool absorbed(RayState s) {
    float size = u_mass * s.x.x;
    return 2.0 * size >= 1.0 || (3.0 * size > 1.0 && s.v.x > 0.0);
}

bool outside(RayState s) {
    return s.x.x * bounding_radius() < 1.0 && s.v.x < 0.0;
}

float first_step(RayState s) {
    return FIRST_ANGLE / max(s.v.y, 1e-30);
}

// So that no step goes past infinity: a bent ray is farther from it than a straight one, as d^2u/dphi^2 > -u. Outwards,
// what takes a straight ray to the farthest end; its angle from infinity is arcsin q, q = h u / |v|, of which the series
// has a little less. Inwards, a little less than the right angle that a straight ray has left at least; and not more
// than takes u from infinity to the horizon if nothing bends.
float longest_step(RayState s) {
    if (s.v.x >= 0.0) return min(LONGEST_ANGLE / max(s.v.y, 1e-30), 0.5 / max(u_mass * s.v.x, 1e-30));
    float across = s.v.y * s.x.x;
    float inverse_speed = inversesqrt(s.v.x * s.v.x + across * across);
    float q_squared = across * inverse_speed * across * inverse_speed;
    float to_infinity = s.x.x * (1.0 + q_squared * (1.0 / 6.0 + q_squared * (3.0 / 40.0)));
    return (to_infinity - min(1.0 / (FARTHEST_END * bounding_radius()), 0.5 * s.x.x)) * inverse_speed;
}

// What an error of w turns the direction by.
float angular_error(RayState before, RayState after, vec3 dx, vec3 dv) {
    vec2 direction = vec2(after.v.x, after.v.y * after.x.x);
    return abs(dv.x) * inversesqrt(max(dot(direction, direction), 1e-37));
}

// Whether a step is too short to move u and phi.
bool stalls(RayState s, float h) {
    return h * abs(s.v.x) <= ROUNDING * s.x.x && h * s.v.y <= ROUNDING * s.x.y;
}
