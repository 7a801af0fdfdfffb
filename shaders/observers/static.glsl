// Provides chart_direction() of an observer at rest: directions are measured in his orthonormal frame, which the
// model's metric turns into the chart's.

vec3 static_frame(vec3 x, vec3 direction);  // the model's: orthonormal frame at rest -> chart

vec3 chart_direction(vec3 x, vec3 direction) {
    return normalize(static_frame(x, direction));
}
