// A triangle that covers the viewport. Its depth is the z that the early z test compares: 0.5 for the working
// passes, 0 for the passes that mark a ray as ended (Section 4.1 of the paper).

uniform float u_quad_depth;

void main() {
    vec2 corner = vec2(float((gl_VertexID & 1) << 2), float((gl_VertexID & 2) << 1)) - 1.0;
    gl_Position = vec4(corner, 2.0 * u_quad_depth - 1.0, 1.0);
}
