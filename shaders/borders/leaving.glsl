// Provides the bounding sphere as the only border of a law that goes on bending rays beyond it: where rays leave it is the
// place that they have their last direction at, wherever the method's steps would have ended.

vec4 bounds(vec3 x);

void hold(vec3 x) {
}

vec4 border(vec3 x) {
    return bounds(x);
}

vec3 border_heart(vec3 x) {
    return x;
}

void cross_border(inout RayState s, inout RayState rate) {
}
