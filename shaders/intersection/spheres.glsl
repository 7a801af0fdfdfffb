// Provides the first sphere of a batch that a segment meets: Glassner 1993, with the check for the segment's finite extent.
// Five texels a sphere: centre and radius; material and object index; the sphere's three axes.

uniform sampler2D u_spheres;
#ifndef TREE
uniform int u_first;
uniform int u_count;
#endif

#ifdef CURVES
vec3 point_at(Curve curve, float t);
vec3 tangent_at(Curve curve, float t);

// From the place that is nearest to the centre along the tangent there, into the sphere, and out of it where the piece
// begins inside; then Newton's method on the cubic that the piece is.
void meet_sphere(int index, Curve piece, inout Hit hit, inout bool met) {
    vec4 sphere = texel(u_spheres, 5 * index);
    vec3 along = piece.b - piece.a;
    float nearest = clamp(dot(sphere.xyz - piece.a, along) / dot(along, along), 0.0, 1.0);
    vec3 way = tangent_at(piece, nearest);
    nearest = clamp(nearest + dot(sphere.xyz - point_at(piece, nearest), way) / dot(way, way), 0.0, 1.0);
    way = tangent_at(piece, nearest);
    vec3 to_centre = sphere.xyz - point_at(piece, nearest);
    float inverse = 1.0 / dot(way, way);
    float closest = dot(to_centre, way) * inverse;
    vec3 gap = to_centre - closest * way;
    float half_chord = sqrt(max(sphere.w * sphere.w - dot(gap, gap), 0.0) * inverse);
    vec3 from_start = piece.a - sphere.xyz;
    bool inside = dot(from_start, from_start) < sphere.w * sphere.w;
    float t = nearest + closest + (inside ? half_chord : -half_chord);
    float excess;
    for (int i = 0; i < 3; ++i) {
        vec3 outward = point_at(piece, t) - sphere.xyz;
        excess = dot(outward, outward) - sphere.w * sphere.w;
        float slope = 2.0 * dot(outward, tangent_at(piece, t));
        t -= excess / slope;
    }
    vec3 outward = point_at(piece, t) - sphere.xyz;
    excess = abs(dot(outward, outward) - sphere.w * sphere.w);
    // Places of the piece have float32's rounding, which a small sphere may not be large against.
    vec3 reach = max(abs(piece.a), abs(piece.b));
    float rounding = 1e-6 * sphere.w * max(max(reach.x, reach.y), reach.z);
    if (excess <= 1e-4 * sphere.w * sphere.w + rounding && lies_before(t, hit.fraction)) {
        hit.fraction = t;
        hit.primitive = index;
        met = true;
    }
}
#else
// along : of the segment;  inverse : 1 / its length squared
void meet_sphere(int index, vec3 from, vec3 along, float inverse, inout Hit hit, inout bool met) {
    vec4 sphere = texel(u_spheres, 5 * index);
    vec3 to_centre = sphere.xyz - from;
    float closest = dot(to_centre, along) * inverse;  // fraction of the point nearest to the centre
    vec3 gap = to_centre - closest * along;
    float under_root = (sphere.w * sphere.w - dot(gap, gap)) * inverse;
    float half_chord = sqrt(under_root);
    float t = closest - half_chord;
    if (t < 0.0) t = closest + half_chord;  // the segment begins inside
    if (under_root >= 0.0 && lies_before(t, hit.fraction)) {
        hit.fraction = t;
        hit.primitive = index;
        met = true;
    }
}
#endif

#ifndef TREE
bool first_hit(Segment segment, inout Hit hit) {
    bool met = false;
    vec3 along = segment.b - segment.a;
    float inverse = 1.0 / dot(along, along);
    for (int i = u_first; i < u_first + u_count; ++i) meet_sphere(i, segment.a, along, inverse, hit, met);
    return met;
}
#endif

void complete_sphere_hit(Segment segment, inout Hit hit) {
    vec4 sphere = texel(u_spheres, 5 * hit.primitive);
    vec4 indices = texel(u_spheres, 5 * hit.primitive + 1);
    hit.material = int(indices.x);
    hit.object_index = indices.y;
    hit.view = normalize(segment.a - segment.b);
    hit.position = mix(segment.a, segment.b, hit.fraction);
    vec3 outward = normalize(hit.position - sphere.xyz);
#ifdef IMAGES
    const float PI = 3.14159265358979;
    mat3 axes = mat3(
        texel(u_spheres, 5 * hit.primitive + 2).xyz,
        texel(u_spheres, 5 * hit.primitive + 3).xyz,
        texel(u_spheres, 5 * hit.primitive + 4).xyz);
    vec3 own = outward * axes;
    hit.uv = vec2(atan(own.y, own.x) / (2.0 * PI) + 0.5, asin(clamp(own.z, -1.0, 1.0)) / PI + 0.5);
#ifdef FILTERED_IMAGES
    float across = max(own.x * own.x + own.y * own.y, 1e-12);  // 0 at the poles, where u means nothing
    hit.uv_border = vec4(-NO_BORDER, 0.0, NO_BORDER, 1.0);
    hit.uv_gradient = mat2x3(
        (own.x * axes[1] - own.y * axes[0]) / (2.0 * PI * across * sphere.w),
        (axes[2] - own.z * outward) / (PI * sqrt(across) * sphere.w));
#endif
#else
    hit.uv = vec2(0.0);
#endif
    hit.normal = dot(outward, hit.view) < 0.0 ? -outward : outward;
}

#ifndef TREE
void complete_hit(Segment segment, inout Hit hit) {
    complete_sphere_hit(segment, hit);
}
#endif
