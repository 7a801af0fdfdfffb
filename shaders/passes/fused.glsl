// The fused pipeline: the whole life of a ray in one program, the unrolled loop of the paper's Section 7. Ray setup,
// steps of the ODE, the intersection of what they give, and in the end, once, the shading of the hit or the sky.
//
// Steps and what is intersected are independent (Section 3.2): steps are as long as the integrator's error allows. What
// passes through empty space is done with. From the first step that is near an object on, steps are joined to a piece, a
// cubic or a quintic, until it bends by more than the chord tolerance; then it goes down the tree, as curved parts that
// are straight enough for boxes, or as chords that the tolerance allows.
//
// A draw has to be short: a ray that is not at its end after u_draw_steps is written down, and taken up again by the next
// draw (RESUMED).

void camera_ray(vec2 pixel, out vec3 origin, out vec3 direction);  // where and which way pixel looks
RayState ray_start(vec2 pixel, vec3 origin, vec3 direction, float radius, out float tau);  // at the bounding sphere, if outside it
vec3 ray_direction(RayState s);
#ifndef STRAIGHT
RayState rhs(RayState s);  // d/dtau of the state
void take_step(inout Ray ray);      // one step, or an attempt that does not stand
float first_try(RayState rate);     // the step to try where nothing is known of a step's error
float first_demand();
float first_error(RayState start);
bool absorbed(RayState s);
bool captured(RayState s);   // certain to be absorbed
bool outside(RayState s);    // the ray left the bounding sphere and cannot come back
float time_left(float tau);  // until the model ends a ray that has met nothing
vec4 far_bend(RayState s, vec3 d);  // by what a ray still turns beyond the bounding sphere, and what that leaves out
void hold(vec3 x);           // the law's formula in the region that x is in
vec2 border_gap(RayState s, RayState rate);                // how far its border is, and how fast that changes
void cross_border(inout RayState s, inout RayState rate);  // into the region on the other side
float bounding_radius();
uniform int u_max_steps;
#ifdef CURVES
uniform float u_chord_tolerance;  // radians
uniform float u_stray_limit;      // how far a part of a piece may stray from its chord
const int MOST_PARTS = 64;        // of a piece
#ifdef QUINTIC
const float LARGEST_BEND = 0.0173;  // the largest t^2 (1 - t)^3 / 2: what an error of the second derivative does
#endif

Curve curve_through(vec3 a, vec3 before, vec3 b, vec3 after);
#ifdef QUINTIC
vec3 bend_a(Curve curve, vec3 force);
vec3 bend_b(Curve curve, vec3 force);
Curve part_of(Curve curve, vec3 at_a, vec3 at_b, float t0, float t1);
#else
Curve part_of(Curve curve, float t0, float t1);
#endif
vec3 point_at(Curve curve, float t);
vec3 tangent_at(Curve curve, float t);
float stray(vec3 a, vec3 before, vec3 b, vec3 after, out vec2 fractions);
float first_near(Curve piece, vec3 off, inout float room);
#endif
#else
uniform float u_escape_radius;
float bounding_radius() {
    return u_escape_radius;
}
#endif
#ifdef GEOMETRY
#ifdef CURVES
bool first_hit(Curve piece, Probe probe, inout Hit hit);
#else
bool first_hit(Segment chord, Probe probe, inout Hit hit);
#endif
Probe make_probe(vec3 a, vec3 b, float radius);
bool lost();  // whether the search for a hit was broken off
#endif
#ifdef FAR_SIDE
RayState own_side(RayState s);  // the state in the chart of the side that it is on
#endif
#ifdef ORBIT
// The loop's state is in a chart of its own, and tau its parameter; at both ends of the ray it is in space.
RayState orbit_state(RayState start);
RayState space_state(RayState s, RayState start, out float tau);
float first_step(RayState s);
float angular_error(RayState before, RayState after, vec3 dx, vec3 dv);
bool stalls(RayState s, float h);
#endif
#ifdef DRIFT
vec4 invariants(RayState s);  // what the model conserves
#endif
#ifdef FREQUENCY
float frequency_shift(vec3 x, vec3 direction);  // of light from infinity, seen by the observer
float clock_rate(vec3 x);                       // of a clock at rest, against one at infinity
#endif
#ifdef COLOR
#ifdef FILTERED_SKY
vec4 environment(vec3 direction, Footprint footprint);
#else
vec4 environment(vec3 direction);
#endif
#ifdef FAR_SKY
bool far_side(vec3 x);
#ifdef FILTERED_FAR_SKY
vec4 far_environment(vec3 direction, Footprint footprint);
#else
vec4 far_environment(vec3 direction);
#endif
#endif
#ifdef GEOMETRY
vec4 shade(Hit hit);
#endif
uniform vec4 u_failed_color;  // alpha 0: the environment
#endif
#ifdef FILTERED
Footprint footprint_at(vec3 place, vec3 normal, vec3 kind, float unbent, float steepest);
uniform vec2 u_pixel_cone;  // of an unbent ray: a pixel's width at the camera, and its growth with the way
#endif
#ifdef TRIANGLES
void complete_triangle_hit(Segment segment, inout Hit hit);  // position, normal, uv, material
#endif
#ifdef SPHERES
void complete_sphere_hit(Segment segment, inout Hit hit);
#endif

#ifndef STRAIGHT
uniform int u_draw_steps;  // of a ray in this draw
uniform int u_pause;       // steps after which a ray waits for whether it may go on
#endif
#ifdef RESUMED
uniform sampler2D u_ray;  // the outputs of the last draw, side by side: x, v, more and, where it is asked for, rejected
#ifdef REJECTED
const int RAY_TEXELS = 4;
#else
const int RAY_TEXELS = 3;
#endif
#endif
#ifdef QUAD_LIST
uniform sampler2D u_quads;  // the pixels at the lower left corners of the 2 x 2 quads to draw
#endif
uniform vec2 u_pixel_offset;  // of this tile's corner in the whole image, plus the sample's place in the pixel
uniform float u_step;

out vec4 out_x;  // where it ended, tau
out vec4 out_v;  // unit direction there, status; v of a ray that is to go on
#ifndef STRAIGHT
out vec4 out_more;  // for going on: the next step size, what the last one demanded, the errors' sum, steps taken
#endif
#ifdef REJECTED
out vec4 out_rejected;  // of the steps taken, those whose result did not stand
#endif
#ifdef COLOR
out vec4 out_color;
#endif
#ifdef SURFACE_PASSES
out vec4 out_surface;  // normal, object index
#endif
#ifdef TALLY
out vec4 out_tally;  // tau, steps, error estimate, drift of the invariants
#endif
#ifdef FREQUENCY
out vec4 out_frequency;  // seen, as a multiple of that emitted at rest; 0 where no light comes from
#endif

#ifndef STRAIGHT
// As outside() has it, with the derivative at hand where the state is in space.
bool escaped(RayState s, RayState rate) {
#ifdef FAR_SIDE
    return outside(s);
#else
#ifdef ORBIT
    return outside(s);
#else
    return dot(s.x, s.x) > bounding_radius() * bounding_radius() && dot(s.x, rate.x) > 0.0;
#endif
#endif
}
#endif

#ifndef STRAIGHT
// RUNNING for a ray that goes on. One that is certain to be absorbed is, whatever the method makes of it.
float status_of(inout Ray ray) {
    bool was_captured = ray.is_captured;
    ray.is_captured = captured(ray.state);
    if (ray.status == RUNNING && ray.taken >= u_max_steps) ray.status = STEP_LIMIT;
    if (absorbed(ray.state) || (was_captured && (!ray.is_captured || ray.status != RUNNING))) return ABSORBED;
    if (ray.status == NOT_FINITE) return NOT_FINITE;
    if (escaped(ray.state, ray.rate)) return ESCAPED;
    if (time_left(ray.tau) <= 0.0) return LEFT_DOMAIN;
    return ray.status;
}
#endif

#ifdef CURVES
// What lies between two states.
struct Piece {
    Curve curve;
    vec3 off;  // how far the ray may be from the curve along each axis
#ifdef QUINTIC
    vec3 bend_a;
    vec3 bend_b;
#endif
};

Piece piece_between(vec3 a, RayState rate_a, vec3 b, RayState rate_b, float span) {
    Piece piece;
    piece.curve = curve_through(a, span * rate_a.x, b, span * rate_b.x);
    piece.off = vec3(0.0);
#ifdef QUINTIC
    piece.bend_a = bend_a(piece.curve, span * span * rate_a.v);
    piece.bend_b = bend_b(piece.curve, span * span * rate_b.v);
    piece.off = LARGEST_BEND * (abs(piece.bend_a) + abs(piece.bend_b));
#endif
    return piece;
}

// The curve's chord, made as thick as it strays from it, and as long as its inner Bezier points reach.
Probe thick_probe(Curve curve) {
    vec2 reach;
    float strays = stray(curve.a, curve.first, curve.b, tangent_at(curve, 1.0), reach);
    Probe probe = make_probe(curve.a, curve.b, strays);
    probe.begin = min(min(reach.x, reach.y), 0.0);
    probe.end = max(max(reach.x, reach.y), 1.0);
    return probe;
}
#endif

void main() {
    vec3 origin, direction;
#ifdef QUAD_LIST
    ivec2 drawn = ivec2(gl_FragCoord.xy);
    vec2 pixel = texelFetch(u_quads, drawn / 2, 0).xy + vec2(drawn & 1) + 0.5;
#else
    vec2 pixel = gl_FragCoord.xy;
#endif
    pixel += u_pixel_offset;
    camera_ray(pixel, origin, direction);
    float tau;
#ifdef STRAIGHT
    RayState s = ray_start(pixel, origin, direction, bounding_radius(), tau);
    float way = u_step;
    float status = ESCAPED;
#ifdef GEOMETRY
    Hit hit;
    hit.fraction = 1.0;
    Segment line = Segment(s.x, s.x + way * s.v);
    if (first_hit(line, make_probe(line.a, line.b, 0.0), hit)) {
        status = HIT;
        way *= hit.fraction;
    }
#endif
    s.x += way * s.v;
    tau += way;
#else
#ifdef ORBIT
    float tau_before;
    RayState start = ray_start(pixel, origin, direction, bounding_radius(), tau_before);
#endif
    Ray ray;
    ray.rejected = 0.0;
#ifdef RESUMED
    ivec2 written = ivec2(RAY_TEXELS * drawn.x, drawn.y);
    vec4 x = texelFetch(u_ray, written, 0);
    vec4 v = texelFetch(u_ray, written + ivec2(1, 0), 0);
    vec4 more = texelFetch(u_ray, written + ivec2(2, 0), 0);
    ray.state = RayState(x.xyz, v.xyz);
    ray.tau = x.w;
    ray.h = more.x;
    ray.demand = more.y;
    ray.error = more.z;
    ray.taken = int(more.w);
#ifdef REJECTED
    ray.rejected = texelFetch(u_ray, written + ivec2(3, 0), 0).x;
#endif
    hold(ray.state.x);
    ray.rate = rhs(ray.state);
    ray.status = ray.taken < u_max_steps ? RUNNING : STEP_LIMIT;
    if (v.w != RUNNING) ray.status = NOT_FINITE;  // one that is at its end is here for its quad's sake only
#else
#ifdef ORBIT
    ray.error = first_error(start);
    ray.state = orbit_state(start);
    ray.tau = 0.0;
#else
    ray.state = ray_start(pixel, origin, direction, bounding_radius(), ray.tau);
    ray.error = first_error(ray.state);
#endif
    hold(ray.state.x);
    ray.rate = rhs(ray.state);
#ifdef ORBIT
    ray.h = first_step(ray.state);
#else
    ray.h = first_try(ray.rate);
#endif
    ray.demand = first_demand();
    ray.taken = 0;
    ray.status = RUNNING;
    if (absorbed(ray.state)) ray.status = ABSORBED;
    else if (escaped(ray.state, ray.rate)) ray.status = ESCAPED;
#endif
    ray.gap = border_gap(ray.state, ray.rate);
    ray.border_ahead = NO_BORDER_AHEAD;
    ray.at_border = false;
    ray.is_captured = captured(ray.state);
    int draw_end = min(ray.taken + u_draw_steps, u_pause);
#ifdef CURVES
    Hit hit;
    Segment line = Segment(ray.state.x, ray.state.x);  // where the ray hits: from there on along it
    vec3 hit_direction;
    vec3 piece_x = ray.state.x;  // where the piece begins
    RayState piece_rate = ray.rate;
    float piece_tau = ray.tau;
    float room = 0.0;  // cells that are known to be empty around where it does
#endif
    // A draw ends on no attempt: it would not be known where the border was found.
    while (ray.status == RUNNING && (ray.taken < draw_end || ray.border_ahead < NO_BORDER_AHEAD)) {
#ifdef CURVES
        bool piece_ready = false;
        float near_at = 1.0;
#endif
        do {
            take_step(ray);
            ray.status = status_of(ray);
#ifdef CURVES
            // Is the piece near anything? If not, the next one begins here. Is it due?
            Piece so_far = piece_between(piece_x, piece_rate, ray.state.x, ray.rate, ray.tau - piece_tau);
            float room_after = room;
            near_at = first_near(so_far.curve, so_far.off, room_after);
            if (near_at >= 1.0) {
                piece_x = ray.state.x;
                piece_rate = ray.rate;
                piece_tau = ray.tau;
                room = room_after;
            } else {
                vec2 reach;
                vec3 along = (ray.tau - piece_tau) * ray.rate.x;
                float bends = stray(piece_x, so_far.curve.first, ray.state.x, along, reach);
                piece_ready = bends > 0.25 * u_chord_tolerance * ray.tau * length(ray.rate.x);
            }
#endif
        } while (ray.status == RUNNING && !ray.at_border && (ray.taken < draw_end || ray.border_ahead < NO_BORDER_AHEAD)
#ifdef CURVES
            && !piece_ready
#endif
        );
#ifdef CURVES
        piece_ready = near_at < 1.0;
        // The piece that is due; again, since what a loop hands on is stored in each of its rounds.
        float span = ray.tau - piece_tau;
        Piece piece = piece_between(piece_x, piece_rate, ray.state.x, ray.rate, span);
        vec2 reach;
        float strays = stray(piece_x, span * piece_rate.x, ray.state.x, span * ray.rate.x, reach);
        // Chords where the tolerance allows them to be as long as curved parts; they meet fewer boxes.
        float tolerated = u_chord_tolerance * max(ray.tau * length(ray.rate.x), 1e-30);
        float chords = ceil(sqrt(strays / tolerated));
        float needed = ceil(sqrt(strays / max(u_stray_limit, 1e-30)));
        bool straight = chords <= needed;
        if (straight) needed = chords;
#ifdef QUINTIC
        // A cubic's error falls with the fourth power of its length.
        needed = max(needed, sqrt(sqrt(length(piece.off) / (0.25 * tolerated))));
#endif
        int parts = int(clamp(ceil(needed), 1.0, float(MOST_PARTS)));
        // The piece's parts against the objects, from the first on that is near one; in a loop of its own, so that rays
        // which are drawn together go down the tree together.
        float share = 1.0 / float(parts);
        int k = piece_ready ? min(int(near_at * float(parts)), parts - 1) : parts;
        while (k < parts) {
#ifdef QUINTIC
            Curve part = part_of(piece.curve, piece.bend_a, piece.bend_b, float(k) * share, float(k + 1) * share);
#else
            Curve part = part_of(piece.curve, float(k) * share, float(k + 1) * share);
#endif
            if (straight) part = Curve(part.a, part.b, part.b - part.a, vec3(0.0), vec3(0.0));
            hit.fraction = 1.0;
            ++k;
            if (first_hit(part, thick_probe(part), hit)) {
                hit_direction = normalize(tangent_at(part, hit.fraction));
                line.a = point_at(part, hit.fraction);
                // At a loose tolerance a curve may take a short cut through a horizon, where nothing is to be seen.
                ray.status = absorbed(RayState(line.a, ray.state.v)) ? ABSORBED : HIT;
                line.b = line.a + hit_direction;
                ray.tau = piece_tau + (float(k - 1) + hit.fraction) * share * span;
                hit.fraction = 0.0;
                k = parts;
            }
        }
        if (ray.status == HIT) break;
        room = 0.0;
#endif
        if (ray.at_border) {
            cross_border(ray.state, ray.rate);
            ray.gap = border_gap(ray.state, ray.rate);
        }
#ifdef CURVES
        piece_x = ray.state.x;
        piece_rate = ray.rate;
        piece_tau = ray.tau;
#endif
    }
    out_more = vec4(ray.h, ray.demand, ray.error, float(ray.taken));
#ifdef REJECTED
    out_rejected = vec4(ray.rejected);
#endif
    RayState s = ray.state;
    tau = ray.tau;
    float status = ray.status;
#ifdef ORBIT
    if (ray.taken == 0) s = start;
    else if (status != RUNNING) s = space_state(s, start, tau);
    if (status != RUNNING) tau += tau_before;
#endif
#endif

#ifndef STRAIGHT
    if (!finite(s.x) || !finite(s.v)) {
        status = NOT_FINITE;
        s = RayState(vec3(0.0), vec3(0.0));
#ifdef ORBIT
        tau = tau_before;
#endif
    }
#endif
#ifdef GEOMETRY
    if (lost()) status = LOST;
#endif
#ifdef DRIFT
    RayState end = s;
#endif
#ifdef FAR_SIDE
    RayState seen = own_side(s);
#else
    RayState seen = s;
#endif
    out_v = vec4(ray_direction(seen), status);
#ifndef STRAIGHT
    if (status == ESCAPED) {
        vec4 bend = far_bend(seen, out_v.xyz);
        out_v.xyz = normalize(out_v.xyz + bend.xyz);
        ray.error += bend.w;
    }
#endif
    if (status == NOT_FINITE) out_v.xyz = vec3(0.0);
#ifndef STRAIGHT
    if (status == RUNNING) out_v.xyz = s.v;
#endif
#ifdef GEOMETRY
    bool is_hit = status == HIT;
    if (is_hit) {
#ifdef CURVES
        out_v.xyz = hit_direction;
#endif
#ifdef TRIANGLES
        if (hit.primitive >= 0) complete_triangle_hit(line, hit);
#endif
#ifdef SPHERES
        if (hit.primitive < 0) {
            hit.primitive = -1 - hit.primitive;
            complete_sphere_hit(line, hit);
        }
#endif
        s.x = hit.position;
    }
#endif
    out_x = vec4(s.x, tau);
#ifdef SURFACE_PASSES
    out_surface = is_hit ? vec4(hit.normal, hit.object_index) : vec4(0.0);
#endif
#ifdef FILTERED
    // Here, where all four rays of a quad come by: what the pixel covers of the sky or of the surface.
    vec3 kind = vec3(status, 0.0, 0.0);
#ifdef FAR_SKY
    if (far_side(s.x)) kind.x = -status;
#endif
    vec3 place = out_v.xyz;
    vec3 normal = out_v.xyz;
    float unbent = u_pixel_cone.y;
    float steepest = 1.0;
#ifdef GEOMETRY
    if (is_hit) {
        kind.yz = vec2(hit.material, hit.object_index);
        place = hit.position;
        normal = hit.normal;
        unbent = u_pixel_cone.x + u_pixel_cone.y * distance(origin, hit.position);
        steepest = 0.5;
    }
#endif
    Footprint footprint = footprint_at(place, normal, kind, unbent, steepest);
#ifdef FILTERED_IMAGES
    hit.uv_footprint = mat2(footprint.across * hit.uv_gradient, footprint.along * hit.uv_gradient);
#endif
#endif
#ifdef COLOR
    if (status == ABSORBED) out_color = vec4(0.0, 0.0, 0.0, 1.0);
#ifdef GEOMETRY
    else if (is_hit) out_color = shade(hit);
#endif
    else if (status > LEFT_DOMAIN && u_failed_color.a > 0.0) out_color = u_failed_color;
    else if (status == NOT_FINITE) out_color = vec4(0.0, 0.0, 0.0, 1.0);
#ifdef FAR_SKY
#ifdef FILTERED_FAR_SKY
    else if (far_side(s.x)) out_color = far_environment(out_v.xyz, footprint);
#else
    else if (far_side(s.x)) out_color = far_environment(out_v.xyz);
#endif
#endif
#ifdef FILTERED_SKY
    else out_color = environment(out_v.xyz, footprint);
#else
    else out_color = environment(out_v.xyz);
#endif
#endif
#ifdef FREQUENCY
    float shift = status == ABSORBED || status == NOT_FINITE ? 0.0 : frequency_shift(origin, direction);
    if (status == HIT) shift *= clock_rate(s.x);
    out_frequency = vec4(shift);
#endif
#ifdef TALLY
    float drift = 0.0;
#ifdef DRIFT
    float to_first;
    vec4 first = invariants(ray_start(pixel, origin, direction, bounding_radius(), to_first));
    vec4 change = abs(invariants(end) - first);
    vec4 size = abs(first);
    drift = max(max(change.x, change.y), max(change.z, change.w))
        / max(max(max(size.x, size.y), max(size.z, size.w)), 1e-30);
    if (!finite(drift)) drift = 3.0e38;
#endif
#ifdef STRAIGHT
    out_tally = vec4(tau, 1.0, 0.0, drift);
#else
    out_tally = vec4(tau, float(ray.taken), ray.error, drift);
#endif
#endif
}
