// Provides the first triangle of a batch that a segment meets: Carr et al. 2002 (The Ray Engine) in the form of Moeller
// and Trumbore, with the check for the segment's finite extent. Three texels a triangle: corner 0 and material; edge to
// corner 1 and object index; edge to corner 2. Groups of GROUP_SIZE triangles have a bounding sphere each.

uniform sampler2D u_triangles;
uniform sampler2D u_corners;  // normals and uvs, four texels a triangle
#ifndef TREE
uniform int u_first;
uniform int u_count;
#endif

#ifdef CURVES
vec3 point_at(Curve curve, float t);
vec2 parabola_roots(float f0, float f_half, float f1);

const float CONVERGED = 1e-4;  // of a piece: behind such a change, Newton's next one would be below float32's rounding

// Where the piece goes through the triangle's plane: as a parabola does, then by Newton's method on the cubic that it is.
// Its second root is looked at where the first one is no hit: most pieces go through a plane once.
void meet_triangle(int index, Curve piece, inout Hit hit, inout bool met) {
    vec3 corner = texel(u_triangles, 3 * index).xyz;
    vec3 edge1 = texel(u_triangles, 3 * index + 1).xyz;
    vec3 edge2 = texel(u_triangles, 3 * index + 2).xyz;
    vec3 across = cross(edge1, edge2);
    float inverse = inversesqrt(dot(across, across));
    vec3 normal = inverse * across;  // so that distances from the plane are lengths, which float32 can square
    float f0 = dot(piece.a - corner, normal);
    float f1 = dot(piece.first, normal);
    float f2 = dot(piece.second, normal);
    float f3 = dot(piece.third, normal);
    vec2 roots = parabola_roots(f0, f0 + 0.5 * (f1 + 0.5 * (f2 + 0.5 * f3)), dot(piece.b - corner, normal));
    // NaN may count as near: its round is for nothing, and the other root has one as well.
    bvec2 near = bvec2(abs(roots.x - 0.5) < 1.0, abs(roots.y - 0.5) < 1.0);
    float at = near.x ? roots.x : roots.y;
    int left = int(near.x) + int(near.y);
    do {
        float change = 0.0;
        for (int round = 0; round < 3; ++round) {
            change = (f0 + at * (f1 + at * (f2 + at * f3))) / (f1 + at * (2.0 * f2 + 3.0 * at * f3));
            at -= change;
        }
        vec3 from_corner = point_at(piece, at) - corner;
        float u = dot(cross(from_corner, edge2), normal) * inverse;
        float v = dot(cross(edge1, from_corner), normal) * inverse;
        // A parallel or broken triangle gives NaN and infinity: `at` is one of them wherever u, v or change are.
        if (abs(change) < CONVERGED && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && lies_before(at, hit.fraction)) {
            hit.fraction = at;
            hit.primitive = index;
            hit.barycentric = vec2(u, v);
            met = true;
        }
        at = roots.y;
        --left;
    } while (left > 0);
}
#else
void meet_triangle(int index, Segment segment, inout Hit hit, inout bool met) {
    vec3 edge1 = texel(u_triangles, 3 * index + 1).xyz;
    vec3 edge2 = texel(u_triangles, 3 * index + 2).xyz;
    vec3 along = segment.b - segment.a;
    vec3 p = cross(along, edge2);
    float determinant = dot(edge1, p);
    vec3 from_corner = segment.a - texel(u_triangles, 3 * index).xyz;
    vec3 q = cross(from_corner, edge1);
    float inverse = 1.0 / determinant;
    float u = dot(from_corner, p) * inverse;
    float v = dot(along, q) * inverse;
    float t = dot(edge2, q) * inverse;
    // A parallel or broken triangle, or a segment without an end, gives NaN and infinity.
    if (determinant != 0.0 && u >= 0.0 && v >= 0.0 && u + v <= 1.0 && finite(u + v) && lies_before(t, hit.fraction)) {
        hit.fraction = t;
        hit.primitive = index;
        hit.barycentric = vec2(u, v);
        met = true;
    }
}
#endif

#ifndef TREE
#ifdef CULL_GROUPS
const int GROUP_SIZE = 16;
uniform sampler2D u_triangle_groups;  // centre, radius squared

// Whether the segment comes near enough to a group: the distance of the sphere's centre from the chord.
bool near_group(vec4 sphere, Segment segment) {
    vec3 along = segment.b - segment.a;
    vec3 to_centre = sphere.xyz - segment.a;
    float t = clamp(dot(to_centre, along) / max(dot(along, along), 1e-37), 0.0, 1.0);
    vec3 gap = to_centre - t * along;
    return dot(gap, gap) <= sphere.w;
}
#endif

bool first_hit(Segment segment, inout Hit hit) {
    bool met = false;
#ifdef CULL_GROUPS
    for (int group = u_first / GROUP_SIZE; group * GROUP_SIZE < u_first + u_count; ++group) {
        if (!near_group(texel(u_triangle_groups, group), segment)) continue;
        int end = min((group + 1) * GROUP_SIZE, u_first + u_count);
        for (int i = group * GROUP_SIZE; i < end; ++i) meet_triangle(i, segment, hit, met);
    }
#else
    for (int i = u_first; i < u_first + u_count; ++i) meet_triangle(i, segment, hit, met);
#endif
    return met;
}
#endif

void complete_triangle_hit(Segment segment, inout Hit hit) {
    vec4 c0 = texel(u_corners, 4 * hit.primitive);
    vec4 c1 = texel(u_corners, 4 * hit.primitive + 1);
    vec4 c2 = texel(u_corners, 4 * hit.primitive + 2);
    vec4 c3 = texel(u_corners, 4 * hit.primitive + 3);
    vec3 weights = vec3(1.0 - hit.barycentric.x - hit.barycentric.y, hit.barycentric);
    hit.material = int(texel(u_triangles, 3 * hit.primitive).w);
    hit.object_index = texel(u_triangles, 3 * hit.primitive + 1).w;
    hit.view = normalize(segment.a - segment.b);
    hit.position = mix(segment.a, segment.b, hit.fraction);
    vec3 edge1 = texel(u_triangles, 3 * hit.primitive + 1).xyz;
    vec3 edge2 = texel(u_triangles, 3 * hit.primitive + 2).xyz;
    vec3 face = cross(edge1, edge2);
    hit.normal = unit_or(weights.x * c0.xyz + weights.y * c1.xyz + weights.z * c2.xyz, unit_or(face, hit.view));
    if (dot(face, hit.view) < 0.0) hit.normal = -hit.normal;  // seen from behind
    hit.uv = weights.x * vec2(c0.w, c1.w) + weights.y * vec2(c2.w, c3.x) + weights.z * c3.yz;
#ifdef FILTERED_IMAGES
    // The dual basis of the edges: how the weights change with the position.
    float inverse = 1.0 / max(dot(face, face), 1e-37);
    vec3 weight1 = inverse * cross(edge2, face);
    vec3 weight2 = inverse * cross(face, edge1);
    vec2 along1 = vec2(c2.w, c3.x) - vec2(c0.w, c1.w);
    vec2 along2 = c3.yz - vec2(c0.w, c1.w);
    // A surface that ends where the image does shall not show the image's other side there.
    vec2 low = min(min(vec2(c0.w, c1.w), vec2(c2.w, c3.x)), c3.yz);
    vec2 high = max(max(vec2(c0.w, c1.w), vec2(c2.w, c3.x)), c3.yz);
    bvec2 low_ends = lessThan(abs(low - floor(low + 0.5)), vec2(1e-5));
    bvec2 high_ends = lessThan(abs(high - floor(high + 0.5)), vec2(1e-5));
    hit.uv_border = vec4(mix(vec2(-NO_BORDER), low, low_ends), mix(vec2(NO_BORDER), high, high_ends));
    hit.uv_gradient = mat2x3(along1.x * weight1 + along2.x * weight2, along1.y * weight1 + along2.y * weight2);
#endif
}

#ifndef TREE
void complete_hit(Segment segment, inout Hit hit) {
    complete_triangle_hit(segment, hit);
}
#endif
