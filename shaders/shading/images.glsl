// Provides sample_image(): all image textures lie texel after texel in one texture, each from the start of a row.
// One texel an image in u_image_table: first row, width, height, extension + 4 * (closest ? 1 : 0).

uniform sampler2D u_image_table;
uniform sampler2D u_image_texels;

const int REPEAT = 0;
const int EXTEND = 1;
const int CLIP = 2;
const int MIRROR = 3;

const float FARTHEST_UV = 1.0e4;
const int MOST_PERIODS = 20000;  // a bound of what is farthest

// uv less whole periods of the image.
vec2 in_first_period(vec2 uv, int extension) {
    if (extension == REPEAT) return uv - floor(uv);
    if (extension == MIRROR) return uv - 2.0 * floor(0.5 * uv);
    return uv;
}

// Folds a texel index into [0, size); -1 where the image is clipped. In whole numbers: a quotient of floats is rounded, and
// may be a product with the rounded 1 / size. By sums, which are quicker than % next to the first period.
int folded(int i, int size, int extension) {
    if (extension == CLIP) return i < 0 || i >= size ? -1 : i;
    if (extension == EXTEND) return clamp(i, 0, size - 1);
    int period = extension == MIRROR ? 2 * size : size;
    for (int k = 0; k < MOST_PERIODS && (i < 0 || i >= period); ++k) i += i < 0 ? period : -period;
    return i < size ? i : period - 1 - i;
}

// start : index of a picture's first texel in texels;  column, row : folded
vec4 image_texel(sampler2D texels, int start, ivec2 size, int column, int row) {
    if (column < 0 || row < 0) return vec4(0.0);
    return texel(texels, start + row * size.x + column);
}

vec4 bilinear(sampler2D texels, int start, ivec2 size, int extension, vec2 uv) {
    vec2 at = in_first_period(uv, extension) * vec2(size) - 0.5;
    vec2 corner = floor(at);
    vec2 weight = at - corner;
    ivec2 i = ivec2(corner);
    int left = folded(i.x, size.x, extension), right = folded(i.x + 1, size.x, extension);
    int low = folded(i.y, size.y, extension), high = folded(i.y + 1, size.y, extension);
    vec4 below = mix(
        image_texel(texels, start, size, left, low), image_texel(texels, start, size, right, low), weight.x);
    vec4 above = mix(
        image_texel(texels, start, size, left, high), image_texel(texels, start, size, right, high), weight.x);
    return mix(below, above, weight.y);
}

// entry : of the table
vec4 sample_image(vec4 entry, vec2 uv) {
    int start = int(entry.x) << TEXELS_PER_ROW_LOG2;
    int extension = int(entry.w) & 3;
    ivec2 size = ivec2(entry.yz);
    uv = clamp(uv, -FARTHEST_UV, FARTHEST_UV);
    if (int(entry.w) >= 4) {
        ivec2 at = ivec2(floor(in_first_period(uv, extension) * entry.yz));
        int column = folded(at.x, size.x, extension), row = folded(at.y, size.y, extension);
        return image_texel(u_image_texels, start, size, column, row);
    }
    return bilinear(u_image_texels, start, size, extension, uv);
}

vec4 sample_image(int image, vec2 uv) {
    return sample_image(texel(u_image_table, image), uv);
}
