// Provides what lets a piece of a ray pass by everything without a look at the tree: how much space is empty around a
// place (addon/core/empty_space.py). A piece goes through it in strides that are as long as the space is empty.

uniform usampler3D u_empty_space;  // how many cells are empty from each on in all directions, itself included
uniform vec3 u_empty_corner;       // the first cell's low corner, model lengths
uniform vec3 u_empty_size;         // cells along each axis
uniform vec3 u_cells_per_length;

const int MOST_STRIDES = 12;     // then the tree is quicker
const float LEAST_STRIDE = 0.5;  // cells

vec3 point_at(Curve curve, float t);

float largest(vec3 v) {
    return max(max(v.x, v.y), v.z);
}

// How far all is empty around a place along each axis at least, in cells.
float empty_around(vec3 x) {
    vec3 place = (x - u_empty_corner) * u_cells_per_length;
    vec3 inside = clamp(place, vec3(0.5), u_empty_size - 0.5);
    float beyond = largest(abs(place - inside));
    float empty = float(texelFetch(u_empty_space, ivec3(inside), 0).r);
    return max(beyond, empty - beyond) - 1.0;
}

// The first fraction at which the piece is near an object; 1 where there is none, and for a piece that has no place. The
// derivative of a cubic lies in the hull of its own Bezier points, so that no coordinate changes faster than the largest of theirs.
//
// off : how far the ray may be from the piece along each axis, model lengths
// room : how far all is known to be empty around the piece's beginning, cells; behind the call, around its end
float first_near(Curve piece, vec3 off, inout float room) {
    vec3 middle = piece.first + piece.second;
    vec3 after = middle + piece.second + 3.0 * piece.third;
    float fastest = largest(u_cells_per_length * max(max(abs(piece.first), abs(after)), abs(middle)));
    float inverse = 1.0 / max(fastest, 1e-30);
    float kept_off = largest(u_cells_per_length * off);
    float t = max(room - kept_off, 0.0) * inverse;
    for (int i = 0; i < MOST_STRIDES && t < 1.0; ++i) {
        float stride = empty_around(point_at(piece, t)) - kept_off;
        if (stride < LEAST_STRIDE) break;
        t += stride * inverse;
    }
    float ahead = (t - 1.0) * fastest;
    room = finite(ahead) ? max(ahead, 0.0) : 0.0;  // NaN would stay for the rest of the ray
    return lies_before(t, 1.0) ? t : 1.0;
}
