// Provides the first object that a piece of a ray meets, from a tree of bounding boxes: addon/core/bvh.py and
// bvh_nodes.py, two texels a node, which hold both children's boxes. The nearer child is visited first, the other one
// waits on a small stack. Boxes are compared with the piece's chord, made as thick as the piece strays from it.
//
// No walk comes to a node or a leaf twice, so that as many rounds as there are of both are enough. Where a driver walks in
// circles nevertheless, what the piece meets is not known, and the ray is lost.

const int STACK_SIZE = 41;
const int DONE = -1;  // other negative numbers are leaves

uniform usampler2D u_tree;

bool broken_off = false;  // a walk of this ray

bool lost() {
    return broken_off;
}

#ifdef CURVES
float chord_fraction(Curve piece, float t);
#ifdef TRIANGLES
void meet_triangle(int index, Curve piece, inout Hit hit, inout bool met);
#endif
#ifdef SPHERES
void meet_sphere(int index, Curve piece, inout Hit hit, inout bool met);
#endif
#else
#ifdef TRIANGLES
void meet_triangle(int index, Segment piece, inout Hit hit, inout bool met);
#endif
#ifdef SPHERES
void meet_sphere(int index, vec3 from, vec3 along, float inverse, inout Hit hit, inout bool met);
#endif
#endif

Probe make_probe(vec3 a, vec3 b, float radius) {
    vec3 along = b - a;
    vec3 size = max(abs(along), vec3(1e-30));
    vec3 inverse = mix(-1.0 / size, 1.0 / size, greaterThanEqual(along, vec3(0.0)));
    vec3 reach = max(abs(a), abs(b));
    radius += 1e-6 * max(max(reach.x, reach.y), reach.z);  // float32's rounding here and in the objects' own tests
    return Probe(a + radius, a - radius, inverse, 0.0, 1.0);
}

// The fraction at which it comes near the box. For NaN either answer will do: no object is hit there (lies_before()).
float entry(vec3 low, vec3 high, Probe probe) {
    vec3 t_low = (low - probe.to_low) * probe.inverse;
    vec3 t_high = (high - probe.to_high) * probe.inverse;
    vec3 near = min(t_low, t_high);
    vec3 far = max(t_low, t_high);
    float enters = max(max(near.x, near.y), max(near.z, probe.begin));
    float leaves = min(min(far.x, far.y), min(far.z, probe.end));
    return enters <= leaves ? enters : MISSED;
}

// One side of a child's box, an axis each: the cells of its node that it is at.
vec3 side(uvec3 cells, int place) {
    return vec3(ivec3((cells >> place) & 0xffu));
}

// The leaf's objects against the piece: those nearer than hit.fraction. A sphere's row is turned into -1 - row.
#ifdef CURVES
void meet_leaf(int leaf, Curve piece, inout Hit hit, inout bool met) {
#else
void meet_leaf(int leaf, Segment piece, inout Hit hit, inout bool met) {
#endif
    int code = -2 - leaf;
    int first = code >> 3;
    int end = first + ((code >> 1) & 3) + 1;
    bool spheres = (code & 1) == 1;
#ifdef TRIANGLES
    int last = spheres ? first : end;
    for (int i = first; i < last; ++i) meet_triangle(i, piece, hit, met);
#endif
#ifdef SPHERES
#ifdef CURVES
    for (int i = spheres ? first : end; i < end; ++i) meet_sphere(i, piece, hit, met);
#else
    vec3 along = piece.b - piece.a;
    float inverse = 1.0 / dot(along, along);
    for (int i = spheres ? first : end; i < end; ++i) meet_sphere(i, piece.a, along, inverse, hit, met);
#endif
    if (spheres && met) hit.primitive = -1 - hit.primitive;
#endif
}

// The first object that the piece meets before hit.fraction.
#ifdef CURVES
bool first_hit(Curve piece, Probe probe, inout Hit hit) {
#else
bool first_hit(Segment piece, Probe probe, inout Hit hit) {
#endif
    int node = 0;
    bool met = false;
    int stack[STACK_SIZE + 1];  // one more, for the round that finds it full
    stack[0] = DONE;
    int depth = 1;
    // Two texels a node; one leaf more than there are nodes; and one round more, so that some are left.
    int rounds = broken_off ? 0 : (textureSize(u_tree, 0).y << TEXELS_PER_ROW_LOG2) + 2;
    while (node != DONE && rounds > 0) {
        while (node >= 0 && rounds > 0) {
            rounds = depth < STACK_SIZE ? rounds - 1 : 0;
            uvec4 frame = texelFetch(u_tree, texel_place(2 * node), 0);
            uvec4 boxes = texelFetch(u_tree, texel_place(2 * node + 1), 0);
            vec3 corner = uintBitsToFloat(frame.xyz & 0xffffff00u);
            vec3 cell = uintBitsToFloat((frame.xyz & 0xffu) << 23);
            float entry0 = entry(corner + cell * side(boxes.xyz, 0), corner + cell * side(boxes.xyz, 8), probe);
            float entry1 = entry(corner + cell * side(boxes.xyz, 16), corner + cell * side(boxes.xyz, 24), probe);
            int child0 = int(frame.w);
            int child1 = int(boxes.w);
            bool second_first = entry1 < entry0;
            int near = second_first ? child1 : child0;
            if (max(entry0, entry1) < MISSED) {
                stack[depth] = second_first ? child0 : child1;
                ++depth;
                node = near;
            } else if (min(entry0, entry1) < MISSED) {
                node = near;
            } else {
                --depth;
                node = stack[depth];
            }
        }
        if (node < DONE) {
            --rounds;
            bool nearer = false;
            meet_leaf(node, piece, hit, nearer);
            met = met || nearer;
#ifdef CURVES
            if (nearer) probe.end = min(probe.end, chord_fraction(piece, hit.fraction) * 1.00001);
#else
            probe.end = min(probe.end, hit.fraction * 1.00001);
#endif
            --depth;
            node = stack[depth];
        }
    }
    broken_off = rounds == 0;
    return met;
}
