// Early ray termination, Section 4.1: copies the endings that the user lets be skipped into the depth buffer that the
// working passes are tested against (0 at this quad, 1 elsewhere).

uniform sampler2D u_end_v;  // v, status
uniform bool u_cull_hits;
uniform bool u_cull_bounds;

void main() {
    float status = texelFetch(u_end_v, ivec2(gl_FragCoord.xy), 0).w;
    bool ended = status == HIT ? u_cull_hits : status != RUNNING && u_cull_bounds;
    if (!ended) discard;
}
