// Provides what a Rosenbrock method solves in every step: W k = b with
//
//     W = I - gamma h J,   J = d rhs / d(x, v), 6 x 6
//
// J comes from differences of the right-hand side: six evaluations, and no model has to know its derivatives. W is solved
// in blocks of 3 x 3, x first: where dx/dtau = v its upper left block is I. Where that block happens to be singular, the
// result is not finite, and the step is tried again with another size.

RayState rhs(RayState s);  // d/dtau of the state

struct Linearised {
    mat3 inverse_xx;    // of the block of W that takes x to x
    mat3 xv;            // the one that takes v to x
    mat3 vx;            // x to v
    mat3 inverse_vv;    // of what is left of v to v, once x is eliminated: W_vv - W_vx W_xx^-1 W_xv
};

// How far to go for a difference. The root of float32's rounding, as a part of the state, balances rounding and
// curvature; but the step is short where the state is not the scale on which rhs changes, as in a thin front.
float difference(float size, float step_length) {
    return max(clamp(step_length / 32.0, size * exp2(-20.0), size * exp2(-12.0)), 1e-30);
}

// first : the derivative at s
Linearised linearise(RayState s, RayState first, float gamma_h) {
    vec2 moved = gamma_h * vec2(length(first.x), length(first.v));
    float dx = difference(max(length(s.x), moved.x), moved.x);
    float dv = difference(length(s.v), moved.y);
    mat3 xx = mat3(1.0), xv = mat3(0.0), vx = mat3(0.0), vv = mat3(1.0);
    for (int j = 0; j < 3; ++j) {
        vec3 x = s.x, v = s.v;
        x[j] += dx;
        v[j] += dv;
        RayState beside = rhs(RayState(x, s.v));
        RayState faster = rhs(RayState(s.x, v));
        vec2 slope = gamma_h / vec2(x[j] - s.x[j], v[j] - s.v[j]);  // what rounding has left of dx and dv
        xx[j] -= slope.x * (beside.x - first.x);
        vx[j] -= slope.x * (beside.v - first.v);
        xv[j] -= slope.y * (faster.x - first.x);
        vv[j] -= slope.y * (faster.v - first.v);
    }
    mat3 inverse_xx = inverse(xx);
    return Linearised(inverse_xx, xv, vx, inverse(vv - vx * (inverse_xx * xv)));
}

// W^-1 (x, v)
RayState solve(Linearised w, vec3 x, vec3 v) {
    vec3 alone = w.inverse_xx * x;
    vec3 solved = w.inverse_vv * (v - w.vx * alone);
    return RayState(alone - w.inverse_xx * (w.xv * solved), solved);
}
