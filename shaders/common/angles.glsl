// Provides the measure of errors: an angle in radians, so that it can be held against the size of a pixel. A chart of
// orbits has one of its own.

#ifndef ORBIT
// What errors dx and dv at the end of a step mean: the angle that they turn the ray by, or that dx is seen under from the
// model's centre. Both are free of the rounding that a difference of two nearly equal points would carry.
float angular_error(RayState before, RayState after, vec3 dx, vec3 dv) {
    vec3 along = after.x - before.x;
    float turned = dot(dv, dv) / max(dot(after.v, after.v), 1e-37);
    float shifted = dot(dx, dx) / max(max(dot(after.x, after.x), dot(along, along)), 1e-37);
    return sqrt(max(turned, shifted));
}
#endif
