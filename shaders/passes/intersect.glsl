// Ray-object intersection and local illumination, Sections 3.3 and 3.4, in one program as in the paper: one segment of
// every ray against one batch of objects. The depth of a hit is the segment's index plus the fraction along it; the
// fraction is kept beside it, since the sum rounds it: batches must not make a difference, and places keep their digits.

bool first_hit(Segment segment, inout Hit hit);    // the batch's first object with a fraction below hit.fraction
void complete_hit(Segment segment, inout Hit hit);  // position, normal, uv, material of that hit
#ifdef COLOR
vec4 shade(Hit hit);                                // its radiance
#endif

uniform sampler2D u_x_before;
uniform sampler2D u_x;
uniform sampler2D u_depth_before;
uniform float u_segment;

out vec4 out_depth;
#ifdef COLOR
uniform sampler2D u_color_before;
out vec4 out_color;
#endif
#ifdef SURFACE_PASSES
uniform sampler2D u_surface_before;
out vec4 out_surface;  // normal, object index
#endif

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec2 depth = texelFetch(u_depth_before, pixel, 0).xy;
    Segment segment = Segment(texelFetch(u_x_before, pixel, 0).xyz, texelFetch(u_x, pixel, 0).xyz);
    Hit hit;
    hit.fraction = depth.x < NO_HIT ? depth.y : 1.0;
    if (first_hit(segment, hit)) {
        complete_hit(segment, hit);
        out_depth = vec4(u_segment + hit.fraction, hit.fraction, 0.0, 0.0);
#ifdef COLOR
        out_color = shade(hit);
#endif
#ifdef SURFACE_PASSES
        out_surface = vec4(hit.normal, hit.object_index);
#endif
    } else {
        out_depth = vec4(depth, 0.0, 0.0);
#ifdef COLOR
        out_color = texelFetch(u_color_before, pixel, 0);
#endif
#ifdef SURFACE_PASSES
        out_surface = texelFetch(u_surface_before, pixel, 0);
#endif
    }
}
