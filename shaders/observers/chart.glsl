// Provides chart_direction() of the paper's camera: its directions are those of the chart.

vec3 chart_direction(vec3 x, vec3 direction) {
    return direction;
}
