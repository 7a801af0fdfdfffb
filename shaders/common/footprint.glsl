// Provides what a pixel covers of what its ray found: how far that moves from this pixel to the next ones, after all the
// bending. Differences are taken in the 2 x 2 quads that are drawn together, with neighbours that found the same thing.

uniform float u_footprint_scale;      // of a sample's share against the whole pixel
const float LARGEST_FOOTPRINT = 1.0;  // of a sky, radians: beyond it, rays next to each other have nothing in common
const int MOST_PROBES = 8;
const float NO_BORDER = 1.0e30;

// Whether both rays of this row (x) and of this column (y) of the quad are of one kind. A driver may take the
// derivatives of another row or column than this one; hence the values themselves, which the parity brings out.
bvec2 alike(vec3 kind) {
    vec2 odd = vec2(ivec2(gl_FragCoord.xy) & 1);
    vec3 right = dFdx(odd.x * kind), left = -dFdx((1.0 - odd.x) * kind);
    vec3 above = dFdy(odd.y * kind), below = -dFdy((1.0 - odd.y) * kind);
    return bvec2(right == kind && left == kind, above == kind && below == kind);
}

// place : a point of a surface, or a unit direction;  normal : unit;  kind : what must agree with a neighbour
// unbent : the width that counts where no neighbour does;  steepest : the largest sine of a neighbour's way against the
// surface, and half the largest change of the normal: beyond it, it is another part of the object, or its other side.
// To be called by all four rays of a quad.
Footprint footprint_at(vec3 place, vec3 normal, vec3 kind, float unbent, float steepest) {
    Footprint found = Footprint(dFdx(place), dFdy(place));
    bvec2 counts = alike(kind);
    float across = dot(found.across, found.across), along = dot(found.along, found.along);
    vec3 bent_across = dFdx(normal), bent_along = dFdy(normal);
    float bent = 4.0 * steepest * steepest;
    counts.x = counts.x && across < 1.0e30 && dot(bent_across, bent_across) <= bent
        && abs(dot(found.across, normal)) <= steepest * sqrt(across);
    counts.y = counts.y && along < 1.0e30 && dot(bent_along, bent_along) <= bent
        && abs(dot(found.along, normal)) <= steepest * sqrt(along);
    if (!counts.x && !counts.y) {
        vec3 axis = abs(normal.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0);
        found.across = unbent * normalize(cross(normal, axis));
        counts.x = true;
    }
    // Next to an edge the axis that goes there is not known; the other one may be long along the edge.
    if (!counts.x) found.across = cross(found.along, normal) * min(1.0, unbent * inversesqrt(max(along, 1.0e-30)));
    if (!counts.y) found.along = cross(normal, found.across) * min(1.0, unbent * inversesqrt(max(across, 1.0e-30)));
    return Footprint(u_footprint_scale * found.across, u_footprint_scale * found.along);
}

// The principal axes, the longer one first, of the ellipse that has these conjugate ones.
Footprint principal(Footprint given) {
    float sum = 2.0 * dot(given.across, given.along);
    float difference = dot(given.across, given.across) - dot(given.along, given.along);
    float angle = sum == 0.0 && difference == 0.0 ? 0.0 : 0.5 * atan(sum, difference);
    return Footprint(
        cos(angle) * given.across + sin(angle) * given.along, cos(angle) * given.along - sin(angle) * given.across);
}

// How many probes along the longer axis, and of which level of detail, cover an ellipse; long_axis, short_axis : texels.
int probes_for(float long_axis, float short_axis, out float level) {
    float count = clamp(ceil(long_axis / max(short_axis, 1.0) - 0.25), 1.0, float(MOST_PROBES));
    level = log2(max(max(short_axis, long_axis / count), 1.0));
    return int(count);
}
