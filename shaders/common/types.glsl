// Provides the structures that the passes and the chosen files hand each other.
// Lengths are model lengths, space is the model's own, tau is the curve parameter of Eq. (1).

struct RayState {
    vec3 x;  // position
    vec3 v;  // dx/dtau
};

struct Step {
    RayState state;  // after the step
    float error;     // the method's own estimate of the step's error, radians; 0 where it has none
};

const float NO_BORDER_AHEAD = 1.0e30;

struct Ray {             // on its way
    RayState state;
    RayState rate;       // the state's derivative
    float tau;
    float h;             // the next step to try
    float demand;        // of the last step: embedded step control
    float error;         // of its direction, radians, as far as the steps' estimates say
    float status;
    int taken;           // steps, those that did not stand included
    float rejected;      // steps that did not stand
    vec2 gap;            // how far the border of the region that it is in is, and how fast that changes
    float border_ahead;  // tau to the border that the last attempt went past; else NO_BORDER_AHEAD
    bool at_border;      // the last step ended on one
    bool is_captured;    // certain to be absorbed
};

struct Segment {
    vec3 a;  // where the chord begins: fraction 0
    vec3 b;  // where it ends: fraction 1
};

struct Hit {
    float fraction;     // along the segment, in [0, 1)
    int primitive;      // row in the scene texture
    vec2 barycentric;   // triangles only: weights of corners 1 and 2
    vec3 position;      // from here on: filled by complete_hit()
    vec3 normal;        // unit, towards the viewer
    vec3 view;          // unit, from the hit back along the ray
    vec2 uv;
    int material;
    float object_index;
#ifdef FILTERED_IMAGES
    mat2x3 uv_gradient;  // how u and v change with the position
    mat2 uv_footprint;   // columns: how far uv moves from pixel to pixel
    vec4 uv_border;      // low u, low v, high u, high v, which a footprint must not cross; or NO_BORDER
#endif
};
#ifdef FILTERED

struct Footprint {  // what a pixel covers: conjugate axes of an ellipse, as long as it is wide
    vec3 across;
    vec3 along;
};
#endif
#ifdef CURVES

struct Curve {  // a piece of a ray
    vec3 a;       // t = 0
    vec3 b;       // t = 1
    vec3 first;   // x(t) = a + t (first + t (second + t third))
    vec3 second;
    vec3 third;
};
#endif
#ifdef TREE

struct Probe {     // the straight way, thick by a radius, as the slabs of a box are compared with it
    vec3 to_low;   // where it starts, for a box's low corner
    vec3 to_high;  // the same for the high one
    vec3 inverse;  // 1 / its length along each axis
    float begin;   // fractions of it that count
    float end;
};

const float MISSED = 1.0e37;  // a fraction of the way that is not on it
#endif
