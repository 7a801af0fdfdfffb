// Provides value noise with its gradient: random values in [-1, 1] at whole-numbered points, blended by quintics, which
// makes it twice continuously differentiable. The hash is integer arithmetic, exact here and in addon/core/models/noise.py.

const int OCTAVES = 3;

uint hashed(ivec3 cell, uint seed) {
    uvec3 c = uvec3(cell);
    uint h = (c.x * 73856093u) ^ (c.y * 19349663u) ^ (c.z * 83492791u) ^ (seed * 2654435761u);
    h ^= h >> 16u;
    h *= 0x7feb352du;
    h ^= h >> 15u;
    h *= 0x846ca68bu;
    return h ^ (h >> 16u);
}

// 24 bits, so that the float is exact.
float corner_value(ivec3 cell, uint seed) {
    return float(hashed(cell, seed) >> 8u) / 8388608.0 - 1.0;
}

// Gradient and value of one octave.
vec4 value_noise(vec3 q, uint seed) {
    vec3 corner = floor(q);
    vec3 t = q - corner;
    ivec3 c = ivec3(corner);
    vec3 w = t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    vec3 slope = 30.0 * t * t * (1.0 - t) * (1.0 - t);
    float v000 = corner_value(c, seed);
    float v100 = corner_value(c + ivec3(1, 0, 0), seed);
    float v010 = corner_value(c + ivec3(0, 1, 0), seed);
    float v110 = corner_value(c + ivec3(1, 1, 0), seed);
    float v001 = corner_value(c + ivec3(0, 0, 1), seed);
    float v101 = corner_value(c + ivec3(1, 0, 1), seed);
    float v011 = corner_value(c + ivec3(0, 1, 1), seed);
    float v111 = corner_value(c + ivec3(1, 1, 1), seed);
    // Blend along x, then y, then z; each blend hands on what it does not differentiate.
    vec4 along_x = mix(vec4(v000, v010, v001, v011), vec4(v100, v110, v101, v111), w.x);
    vec4 dx = vec4(v100 - v000, v110 - v010, v101 - v001, v111 - v011);
    vec2 along_y = mix(along_x.xz, along_x.yw, w.y);
    vec2 dx_y = mix(dx.xz, dx.yw, w.y);
    vec2 dy = along_x.yw - along_x.xz;
    vec3 gradient = vec3(mix(dx_y.x, dx_y.y, w.z), mix(dy.x, dy.y, w.z), along_y.y - along_y.x);
    return vec4(slope * gradient, mix(along_y.x, along_y.y, w.z));
}

// Gradient and value of OCTAVES octaves, each of half the amplitude and twice the frequency; the value stays in [-1, 1].
vec4 noise(vec3 q, uint seed) {
    vec4 sum = vec4(0.0);
    float amplitude = 4.0 / 7.0;
    float frequency = 1.0;
    for (int octave = 0; octave < OCTAVES; ++octave) {
        sum += amplitude * vec4(vec3(frequency), 1.0) * value_noise(frequency * q, seed + uint(octave));
        amplitude *= 0.5;
        frequency *= 2.0;
    }
    return sum;
}
