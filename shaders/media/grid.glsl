// Provides n(x) from a volume: n = 1 + strength * density, density the cubic B-spline over the voxels.
//
// Why not the trilinear filter: its gradient jumps at every voxel (a ray would see facets), its weights have 8 bits, and
// a smoother gradient taken elsewhere would not be that of n, so that |v| = n is lost. The B-spline stays within the
// densities' own range. The quadratic one would need 27 voxels a point instead of 64, but its force has kinks, which
// error estimates miss: measured, twice the steps and three times the drift. Voxels outside the array are 0, so that n
// is 1 from one and a half cells beyond the box on. addon/core/models/grid.py has the same spline in float64.
//
// A cell is the cube between eight voxels' centres; the spline in it is made of the 64 voxels around it. Where these are
// all equal the cell is still: n is constant, and a ray straight.

uniform sampler3D u_grid;   // density: texel (i, j, k) holds voxels (i - 3 to i, j - 3, k - 3), 0 outside the array
uniform vec3 u_grid_min;    // model lengths; voxel (i, j, k) is centred at it + (i + 1/2, j + 1/2, k + 1/2) u_grid_cell
uniform vec3 u_grid_cell;   // size of a voxel
uniform float u_strength;

// For every block of cells, how many are still from it on in all directions, itself included; 0 where it is not.
uniform sampler3D u_still_blocks;
const int BLOCK = 2;  // cells along a block's side

const vec3 LOW = vec3(-2.0);  // beyond it, and beyond high_end(), n is 1; in cells

vec3 high_end() {
    return vec3(textureSize(u_grid, 0) - ivec3(3, 6, 6)) + 1.0;
}

// In cells, from the centre of the first voxel.
vec3 in_cells(vec3 x) {
    return (x - u_grid_min) / u_grid_cell - 0.5;
}

bool beyond(vec3 at) {
    return !finite(at) || any(lessThan(at, LOW)) || any(greaterThanEqual(at, high_end()));
}

float still_blocks(vec3 cell) {
    return texelFetch(u_still_blocks, (ivec3(cell) + 2) / BLOCK, 0).r;
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
    vec3 at = in_cells(x);
    vec3 cell = floor(at);
    bool outside_box = beyond(at);
    bool still = outside_box || still_blocks(cell) > 0.0;
    ivec3 texel = ivec3(cell) + 2;  // its x holds the first of the 64 voxels
    vec3 t = at - cell;
    vec4 wx = spline(t.x), wy = spline(t.y), wz = spline(t.z);
    vec4 sx = spline_slope(t.x), sy = spline_slope(t.y), sz = spline_slope(t.z);
    vec4 sum = vec4(0.0);  // gradient in cells, density
    // The sum is skipped by its loop: software renderers run through what stands in a branch, taken or not.
    for (int k = still ? 4 : 0; k < 4; ++k) {
        for (int j = 0; j < 4; ++j) {
            vec4 row = texelFetch(u_grid, texel + ivec3(0, j, k), 0);
            float along = dot(wx, row);
            sum += vec4(dot(sx, row) * wy[j] * wz[k], along * sy[j] * wz[k], along * wy[j] * sz[k], along * wy[j] * wz[k]);
        }
    }
    if (still && !outside_box) sum.w = texelFetch(u_grid, texel, 0).x;
    float n = 1.0 + u_strength * sum.w;
    return vec4(n * u_strength * sum.xyz / u_grid_cell, n * n);
}

bool absorbed(RayState s) {
    return false;
}

// A voxel where n varies. Elsewhere the ray is straight, until it enters the box or leaves the still blocks around it.
float longest_step(RayState s) {
    float voxel = min(u_grid_cell.x, min(u_grid_cell.y, u_grid_cell.z)) / max(length(s.v), 1e-30);
    vec3 at = in_cells(s.x);
    vec3 rate = s.v / u_grid_cell;
    rate = mix(rate, vec3(1e-30), lessThan(abs(rate), vec3(1e-30)));
    vec3 low = LOW;
    vec3 high = high_end();
    bool outside_box = beyond(at);
    if (!outside_box) {
        vec3 cell = floor(at);
        float still = still_blocks(cell);
        if (still == 0.0) return voxel;
        low = vec3((ivec3(cell) + 2) / BLOCK * BLOCK - 2) - float(BLOCK) * (still - 1.0);
        high = low + float(BLOCK) * (2.0 * still - 1.0);
    }
    vec3 to_low = (low - at) / rate;
    vec3 to_high = (high - at) / rate;
    vec3 first = min(to_low, to_high);
    vec3 last = max(to_low, to_high);
    float enters = max(first.x, max(first.y, first.z));
    float leaves = min(last.x, min(last.y, last.z));
    if (!outside_box) return max(leaves, voxel);
    return enters > leaves || leaves < 0.0 ? 1e30 : max(enters, voxel);
}
