// Provides a sky as a pixel's footprint sees it: probes along its longer axis, each from the mipmap as coarse as the
// shorter one. A footprint below a texel is one bilinear probe of the finest level.

Footprint principal(Footprint given);
int probes_for(float long_axis, float short_axis, out float level);

// direction : unit;  footprint : radians
vec3 filtered_sky(samplerCube sky, vec3 direction, Footprint footprint) {
    footprint = principal(footprint);
    vec3 size = abs(direction);
    float height = max(max(size.x, size.y), size.z);
    // A texel's solid angle is height^3 times that in the middle of its face.
    float texels = 0.5 * float(textureSize(sky, 0).x) * pow(height, -1.5);
    float long_axis = length(footprint.across);
    if (long_axis > LARGEST_FOOTPRINT) {
        footprint.across *= LARGEST_FOOTPRINT / long_axis;
        long_axis = LARGEST_FOOTPRINT;
    }
    float level;
    int probes = probes_for(texels * long_axis, texels * length(footprint.along), level);
    vec3 sum = vec3(0.0);
    for (int i = 0; i < probes; ++i)
        sum += textureLod(sky, direction + ((float(i) + 0.5) / float(probes) - 0.5) * footprint.across, level).rgb;
    return sum / float(probes);
}
