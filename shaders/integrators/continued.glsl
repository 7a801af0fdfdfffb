// Provides advance_from() by advance(): the derivative behind a step costs one evaluation of the right-hand side.

Step advance(RayState s, float h);
RayState rhs(RayState s);

// first : the derivative at s;  last : the one behind the step
Step advance_from(RayState s, RayState first, float h, out RayState last) {
    Step result = advance(s, h);
    last = rhs(result.state);
    return result;
}
