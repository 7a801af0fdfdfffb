// Provides the border of a force that ends at the radius R of each centre, where it has a kink.

vec3 centre(int i);
int centre_count();

float sense = 1.0;  // of the region that is held: -1 within an odd number of balls

// The distance from the nearest rim, negative within an odd number of balls; and its gradient.
vec4 beyond_rims(vec3 x) {
    vec4 least = vec4(0.0, 0.0, 0.0, 1.0e30);
    float odd = 1.0;
    for (int i = 0; i < centre_count(); ++i) {
        vec3 outward = x - centre(i);
        float r = length(outward);
        float side = r < u_R ? -1.0 : 1.0;
        odd *= side;
        float distance = side * (r - u_R);
        if (distance < least.w) least = vec4(side / max(r, 1e-30) * outward, distance);
    }
    return odd * least;
}

void hold(vec3 x) {
    sense = beyond_rims(x).w < 0.0 ? -1.0 : 1.0;
}

vec4 border(vec3 x) {
    return sense * beyond_rims(x);
}

vec3 border_heart(vec3 x) {
    return nearest_centre(x);
}

bool absorbed(RayState s) {
    return false;
}
