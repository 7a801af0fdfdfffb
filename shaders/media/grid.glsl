// Provides n(x) from a volume: n = 1 + strength * density, density the cubic B-spline over the voxels.
//
// Why not the trilinear filter: its gradient jumps at every voxel (a ray would see facets), its weights have 8 bits, and
// a smoother gradient taken elsewhere would not be that of n, so that |v| = n is lost. The B-spline stays within the
// densities' own range. The quadratic one would need 27 texels a point instead of 64, but its force has kinks, which
// error estimates miss: measured, twice the steps and three times the drift. Voxels outside the array are 0, so that n
// is 1 from one and a half cells beyond the box on. addon/core/models/grid.py has the same spline in float64.

uniform sampler3D u_grid;   // density, voxel (i, j, k) centred at u_grid_min + (i + 1/2, j + 1/2, k + 1/2) u_grid_cell
uniform vec3 u_grid_min;    // model lengths
uniform vec3 u_grid_cell;   // size of a voxel
uniform float u_strength;

float voxel(ivec3 at, ivec3 size) {
    if (any(lessThan(at, ivec3(0))) || any(greaterThanEqual(at, size))) return 0.0;
    return texelFetch(u_grid, at, 0).r;
}

// Weights of the four voxels around a point t in [0, 1] of the way from the second to the third; and their derivatives.
vec4 spline(float t) {
    float u = 1.0 - t;
    return vec4(u * u * u, (3.0 * t - 6.0) * t * t + 4.0, (3.0 * u - 6.0) * u * u + 4.0, t * t * t) / 6.0;
}

vec4 spline_slope(float t) {
    float u = 1.0 - t;
    return 0.5 * vec4(-u * u, (3.0 * t - 4.0) * t, (4.0 - 3.0 * u) * u, t * t);
}

vec4 medium(vec3 x) {
    ivec3 size = textureSize(u_grid, 0);
    vec3 at = (x - u_grid_min) / u_grid_cell;  // in voxels; centres are at halves
    if (any(lessThan(at, vec3(-1.5))) || any(greaterThan(at, vec3(size) + 1.5))) return vec4(0.0, 0.0, 0.0, 1.0);
    vec3 second = floor(at - 0.5);
    vec3 t = at - 0.5 - second;
    ivec3 first = ivec3(second) - 1;
    vec4 wx = spline(t.x), wy = spline(t.y), wz = spline(t.z);
    vec4 sx = spline_slope(t.x), sy = spline_slope(t.y), sz = spline_slope(t.z);
    vec4 sum = vec4(0.0);  // gradient in voxels, density
    for (int k = 0; k < 4; ++k) {
        for (int j = 0; j < 4; ++j) {
            vec4 row;
            for (int i = 0; i < 4; ++i) row[i] = voxel(first + ivec3(i, j, k), size);
            float along = dot(wx, row);
            sum += vec4(dot(sx, row) * wy[j] * wz[k], along * sy[j] * wz[k], along * wy[j] * sz[k], along * wy[j] * wz[k]);
        }
    }
    float n = 1.0 + u_strength * sum.w;
    return vec4(n * u_strength * sum.xyz / u_grid_cell, n * n);
}

bool absorbed(RayState s) {
    return false;
}

// As far as the box is, and a voxel within it.
float longest_step(RayState s) {
    vec3 low = u_grid_min - 1.5 * u_grid_cell;
    vec3 high = u_grid_min + (vec3(textureSize(u_grid, 0)) + 1.5) * u_grid_cell;
    float gap = length(max(max(low - s.x, s.x - high), 0.0));
    return max(gap, min(u_grid_cell.x, min(u_grid_cell.y, u_grid_cell.z))) / max(length(s.v), 1e-30);
}
