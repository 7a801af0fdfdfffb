// Provides the first point of a ray: where the camera is, or where the ray enters the bounding sphere from outside.

vec3 chart_direction(vec3 x, vec3 direction);  // the observer's direction, seen in the chart
RayState first_state(vec3 x, vec3 direction);  // the observer's direction as the model's state
RayState initial_state(vec3 x, vec3 d);        // the model's state for a chart direction
vec3 ray_moment(vec2 pixel, vec3 origin, vec3 direction);  // origin x d, d the unit direction in the chart

// How far a ray may go straight before anything can bend it or be hit: to the bounding sphere, or past it where the ray
// misses it. 0 for a ray that begins inside or leaves.  nearest : of the ray's points, the one nearest to the centre
// before : how far in front of it the straight way ends
float straight_way(vec3 x, vec3 d, vec3 nearest, float radius, out float before) {
    float towards = -dot(x, d);
    before = sqrt(max(radius * radius - dot(nearest, nearest), 0.0));
    return dot(x, x) <= radius * radius || towards <= 0.0 ? 0.0 : towards - before;
}

// No ray is bent or hits anything before it has come within this radius, or within so many impact parameters of the centre.
uniform float u_inner_radius;
uniform float u_bends_within;

// pixel : as camera_ray() has it;  radius : of the bounding sphere;  tau : of the first point
// From the moment, since origin + tau d keeps no digits for a camera far away: it would be wrong by r roundings of d.
RayState ray_start(vec2 pixel, vec3 origin, vec3 direction, float radius, out float tau) {
    vec3 d = chart_direction(origin, direction);
    vec3 moment = ray_moment(pixel, origin, direction);
    float bent_within = max(u_inner_radius, u_bends_within * length(moment));
    vec3 nearest = cross(d, moment);
    float before;
    tau = straight_way(origin, d, nearest, min(radius, bent_within), before);
    if (tau > 0.0) return initial_state(nearest - before * d, d);
    return first_state(origin, direction);
}
