// Ray integration, Section 3.2: u_steps steps of the ODE, then one chord is handed to the intersection.
// Drawn with (n, h) it is the plain integration; step doubling draws it with (n, h) and with (2n, h/2).

Step advance(RayState s, float h);  // one step of the integrator
bool absorbed(RayState s);          // the model swallowed the ray

uniform sampler2D u_x;  // x, tau
uniform sampler2D u_v;  // v, h
uniform int u_steps;
uniform float u_step_factor;

out vec4 out_x;
out vec4 out_v;

void main() {
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    vec4 x = texelFetch(u_x, pixel, 0);
    vec4 v = texelFetch(u_v, pixel, 0);
    RayState s = RayState(x.xyz, v.xyz);
    float h = v.w * u_step_factor;
    int taken = 0;
    for (; taken < u_steps; ++taken) {
        if (absorbed(s)) break;
        s = advance(s, h).state;
    }
    out_x = vec4(s.x, x.w + float(taken) * h);
    out_v = vec4(s.v, v.w);
}
