// Provides dense output: between two points with their derivatives a ray is a cubic (Hermite), right to fourth order.
// It lies in the hull of its Bezier points, so that its distance from the straight way a -> b has a bound.

// before, after : dx/dt at a and b
Curve curve_through(vec3 a, vec3 before, vec3 b, vec3 after) {
    vec3 along = b - a;
    return Curve(a, b, before, 3.0 * along - 2.0 * before - after, before + after - 2.0 * along);
}

vec3 point_at(Curve curve, float t) {
    return curve.a + t * (curve.first + t * (curve.second + t * curve.third));
}

vec3 tangent_at(Curve curve, float t) {
    return curve.first + t * (2.0 * curve.second + 3.0 * t * curve.third);
}

// How far the curve strays from the line a -> b, at most, and the fractions of a -> b that its inner Bezier points stand
// over: the curve goes steadily ahead where they are in order.
float stray(vec3 a, vec3 before, vec3 b, vec3 after, out vec2 fractions) {
    vec3 along = b - a;
    float inverse = 1.0 / max(dot(along, along), 1e-30);
    vec3 p1 = before / 3.0;
    vec3 p2 = along - after / 3.0;
    fractions = vec2(dot(p1, along), dot(p2, along)) * inverse;
    vec3 off1 = p1 - fractions.x * along;
    vec3 off2 = p2 - fractions.y * along;
    return 0.75 * sqrt(max(dot(off1, off1), dot(off2, off2)));
}

// How far along its chord the curve is at t, as a fraction.
float chord_fraction(Curve curve, float t) {
    vec3 along = curve.b - curve.a;
    return dot(point_at(curve, t) - curve.a, along) / max(dot(along, along), 1e-30);
}

#ifdef QUINTIC
// With the second derivatives at a and b, too, the ray is a quintic, right to sixth order: the cubic, and
//
//     t^2 (1 - t)^2 ((1 - t) bend_a + t bend_b) / 2
//
// where bend_a and bend_b are what the cubic's second derivatives lack.

// force : the second derivative at a, d2x/dt2
vec3 bend_a(Curve curve, vec3 force) {
    return force - 2.0 * curve.second;
}

vec3 bend_b(Curve curve, vec3 force) {
    return force - 2.0 * curve.second - 6.0 * curve.third;
}

// Its part between t0 and t1, as a cubic.
Curve part_of(Curve curve, vec3 at_a, vec3 at_b, float t0, float t1) {
    vec2 t = vec2(t0, t1), s = 1.0 - t;
    vec2 even = 0.5 * t * t * s * s, slope = t * s * (s - t);
    vec3 bend0 = mix(at_a, at_b, t0), bend1 = mix(at_a, at_b, t1);
    float share = t1 - t0;
    return curve_through(
        point_at(curve, t0) + even.x * bend0,
        share * (tangent_at(curve, t0) + slope.x * bend0 + even.x * (at_b - at_a)),
        point_at(curve, t1) + even.y * bend1,
        share * (tangent_at(curve, t1) + slope.y * bend1 + even.y * (at_b - at_a)));
}
#else
// The part of a curve between t0 and t1.
Curve part_of(Curve curve, float t0, float t1) {
    float share = t1 - t0;
    return curve_through(
        point_at(curve, t0), share * tangent_at(curve, t0), point_at(curve, t1), share * tangent_at(curve, t1));
}
#endif

// Where the parabola with these values at 0, 1/2 and 1 is zero; NaN where it is not.
vec2 parabola_roots(float f0, float f_half, float f1) {
    float a = 2.0 * (f0 + f1) - 4.0 * f_half;
    float b = f1 - f0 - a;
    float q = -0.5 * (b + (b < 0.0 ? -1.0 : 1.0) * sqrt(b * b - 4.0 * a * f0));
    return vec2(f0 / q, q / a);
}
