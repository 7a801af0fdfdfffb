// Provides the first point of a ray: where the camera is, or where the ray enters the bounding sphere from outside.

vec3 chart_direction(vec3 x, vec3 direction);  // the observer's direction, seen in the chart
RayState first_state(vec3 x, vec3 direction);  // the observer's direction as the model's state
RayState initial_state(vec3 x, vec3 d);        // the model's state for a chart direction

// How far a ray may go straight before anything can bend it or be hit: to the bounding sphere, or past it where the ray
// misses it. 0 for a ray that begins inside or leaves.
float straight_way(vec3 x, vec3 d, float radius) {
    float towards = -dot(x, d);
    float beyond = dot(x, x) - radius * radius;
    if (beyond <= 0.0 || towards <= 0.0) return 0.0;
    vec3 nearest = x + towards * d;  // its length keeps digits that towards^2 - beyond loses for a far camera
    float under_root = radius * radius - dot(nearest, nearest);
    return under_root > 0.0 ? towards - sqrt(under_root) : towards;
}

// No ray is bent or hits anything before it has come within this radius, or within so many impact parameters of the centre.
uniform float u_inner_radius;
uniform float u_bends_within;

// radius : of the bounding sphere;  tau : of the first point
RayState ray_start(vec3 origin, vec3 direction, float radius, out float tau) {
    vec3 d = chart_direction(origin, direction);
    float bent_within = max(u_inner_radius, u_bends_within * length(cross(origin, d)));
    tau = straight_way(origin, d, min(radius, bent_within));
    if (tau > 0.0) return initial_state(origin + tau * d, d);
    return first_state(origin, direction);
}
