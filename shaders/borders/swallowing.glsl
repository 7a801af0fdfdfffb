// Provides borders that no ray comes back from: absorbed() is true on them, and there is only one region.

void hold(vec3 x) {
}

void cross_border(inout RayState s, inout RayState rate) {
}
