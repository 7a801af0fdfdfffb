// Provides sample_image(): all image textures lie texel after texel in one texture, each from the start of a row.
// One texel an image in u_image_table: first row, width, height, extension + 4 * (closest ? 1 : 0).

uniform sampler2D u_image_table;
uniform sampler2D u_image_texels;

const int REPEAT = 0;
const int EXTEND = 1;
const int CLIP = 2;
const int MIRROR = 3;

// Folds a texel index into [0, size); -1 where the image is clipped.
int folded(int i, int size, int extension) {
    if (extension == REPEAT) return i - size * int(floor(float(i) / float(size)));
    if (extension == MIRROR) {
        int period = 2 * size;
        int j = i - period * int(floor(float(i) / float(period)));
        return j < size ? j : period - 1 - j;
    }
    if (extension == CLIP && (i < 0 || i >= size)) return -1;
    return clamp(i, 0, size - 1);
}

// start : index of a picture's first texel in texels
vec4 image_texel(sampler2D texels, int start, ivec2 size, int extension, ivec2 at) {
    int column = folded(at.x, size.x, extension);
    int row = folded(at.y, size.y, extension);
    if (column < 0 || row < 0) return vec4(0.0);
    return texel(texels, start + row * size.x + column);
}

vec4 bilinear(sampler2D texels, int start, ivec2 size, int extension, vec2 uv) {
    vec2 at = uv * vec2(size) - 0.5;
    vec2 corner = floor(at);
    vec2 weight = at - corner;
    ivec2 i = ivec2(corner);
    vec4 below = mix(
        image_texel(texels, start, size, extension, i),
        image_texel(texels, start, size, extension, i + ivec2(1, 0)), weight.x);
    vec4 above = mix(
        image_texel(texels, start, size, extension, i + ivec2(0, 1)),
        image_texel(texels, start, size, extension, i + ivec2(1, 1)), weight.x);
    return mix(below, above, weight.y);
}

// entry : of the table
vec4 sample_image(vec4 entry, vec2 uv) {
    int start = int(entry.x) << TEXELS_PER_ROW_LOG2;
    int extension = int(entry.w) & 3;
    ivec2 size = ivec2(entry.yz);
    uv = clamp(uv, -1.0e4, 1.0e4);
    if (int(entry.w) >= 4) return image_texel(u_image_texels, start, size, extension, ivec2(floor(uv * entry.yz)));
    return bilinear(u_image_texels, start, size, extension, uv);
}

vec4 sample_image(int image, vec2 uv) {
    return sample_image(texel(u_image_table, image), uv);
}
