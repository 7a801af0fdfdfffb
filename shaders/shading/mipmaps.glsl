// Provides an image as a pixel's footprint sees it: probes along its longer axis, each from the two levels of detail
// next to the shorter one. Level 0 is the image itself, as sample_image() has it; the others lie in u_image_mips, level
// after level, each half as wide and high as the one before, rounded down. One texel an image in u_mip_table: first row
// and the last level.

vec4 sample_image(vec4 entry, vec2 uv);
vec4 bilinear(sampler2D texels, int start, ivec2 size, int extension, vec2 uv);
Footprint principal(Footprint given);
int probes_for(float long_axis, float short_axis, out float level);

uniform sampler2D u_mip_table;
uniform sampler2D u_image_mips;

struct Level {
    int start;  // index of its first texel in u_image_mips
    ivec2 size;
};

Level level_at(int level, int start, ivec2 size) {
    size = max(size / 2, 1);
    for (int i = 1; i < level; ++i) {
        start += size.x * size.y;
        size = max(size / 2, 1);
    }
    return Level(start, size);
}

vec4 level_color(Level level, int extension, vec2 uv, vec4 border) {
    vec2 half_texel = 0.5 / vec2(level.size);
    uv = clamp(uv, border.xy + half_texel, border.zw - half_texel);
    return bilinear(u_image_mips, level.start, level.size, extension, uv);
}

// footprint : columns are how far uv moves from pixel to pixel;  border : low and high corner, not to be crossed
vec4 filtered_image(int image, vec2 uv, mat2 footprint, vec4 border) {
    vec4 entry = texel(u_image_table, image);
    vec2 mips = texel(u_mip_table, image).xy;
    // Beyond the whole image, the levels end; larger numbers would only lose digits.
    vec2 across = clamp(footprint[0], -1.0e4, 1.0e4) * entry.yz;
    vec2 along = clamp(footprint[1], -1.0e4, 1.0e4) * entry.yz;
    Footprint axes = principal(Footprint(vec3(across, 0.0), vec3(along, 0.0)));
    float detail;
    int probes = probes_for(length(axes.across), length(axes.along), detail);
    detail = min(detail, mips.y);
    int finer = int(detail);
    float coarser_share = detail - float(finer);
    int extension = int(entry.w) & 3;
    int start = int(mips.x) << TEXELS_PER_ROW_LOG2;
    Level fine = level_at(finer, start, ivec2(entry.yz));
    Level coarse = level_at(finer + 1, start, ivec2(entry.yz));
    uv = clamp(uv, -1.0e4, 1.0e4);
    vec4 sum = vec4(0.0);
    for (int i = 0; i < probes; ++i) {
        vec2 at = uv + ((float(i) + 0.5) / float(probes) - 0.5) * axes.across.xy / entry.yz;
        if (detail > 0.0 || probes > 1) at = clamp(at, border.xy + 0.5 / entry.yz, border.zw - 0.5 / entry.yz);
        vec4 found = finer == 0 ? sample_image(entry, at) : level_color(fine, extension, at, border);
        if (coarser_share > 0.0) found = mix(found, level_color(coarse, extension, at, border), coarser_share);
        sum += found;
    }
    return sum / float(probes);
}
