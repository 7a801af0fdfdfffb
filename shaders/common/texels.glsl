// Provides reads from the scene textures: long rows of RGBA texels, folded into TEXELS_PER_ROW columns
// (addon/core/textures.py writes them).

const int TEXELS_PER_ROW_LOG2 = 11;

ivec2 texel_place(int index) {
    return ivec2(index & ((1 << TEXELS_PER_ROW_LOG2) - 1), index >> TEXELS_PER_ROW_LOG2);
}

vec4 texel(sampler2D data, int index) {
    return texelFetch(data, texel_place(index), 0);
}
