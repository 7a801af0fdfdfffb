// Provides the local illumination of Section 3.4: ambient, emissive, textured, and "fake" Blinn-Phong, whose lights shine
// straight onto the hit point, whatever lies between. Three texels a material: base colour and image, emission and image,
// roughness and specular. Light units are Blender's, so that the diffuse part is what Cycles gives without shadows.

const float INVERSE_PI = 0.318309886183791;

uniform sampler2D u_materials;
uniform vec3 u_ambient;  // radiance that comes from everywhere

#ifdef IMAGES
#ifdef FILTERED_IMAGES
vec4 filtered_image(int image, vec2 uv, mat2 footprint, vec4 border);  // scene-linear colour and alpha

vec3 image_color(float image, Hit hit) {
    return filtered_image(int(image), hit.uv, hit.uv_footprint, hit.uv_border).rgb;
}
#else
vec4 sample_image(int image, vec2 uv);  // scene-linear colour and alpha

vec3 image_color(float image, Hit hit) {
    return sample_image(int(image), hit.uv).rgb;
}
#endif
#endif
#ifdef LIGHTS
struct Illumination {
    vec3 irradiance;  // on a surface that faces the light
    vec3 towards;     // unit, from the hit to the light
};

int light_count();
Illumination light_at(int index, vec3 position);

vec3 lit(Hit hit, vec3 base_color, float roughness, float specular) {
    vec3 radiance = vec3(0.0);
    float alpha = max(roughness * roughness, 1e-3);
    float exponent = max(2.0 / (alpha * alpha) - 2.0, 1.0);
    for (int i = 0; i < light_count(); ++i) {
        Illumination light = light_at(i, hit.position);
        float cosine = dot(hit.normal, light.towards);
        if (cosine <= 0.0) continue;
        vec3 reflectance = base_color * INVERSE_PI;
        if (specular > 0.0) {
            float highlight = max(dot(hit.normal, normalize(light.towards + hit.view)), 0.0);
            // Principled's default specular of 0.5 is a reflectance of 4 % at normal incidence.
            reflectance += 0.08 * specular * (exponent + 8.0) * 0.125 * INVERSE_PI * pow(highlight, exponent);
        }
        radiance += reflectance * cosine * light.irradiance;
    }
    return radiance;
}
#endif

vec4 shade(Hit hit) {
    vec4 base = texel(u_materials, 3 * hit.material);
    vec4 emission = texel(u_materials, 3 * hit.material + 1);
#ifdef IMAGES
    if (base.w >= 0.0) base.rgb *= image_color(base.w, hit);
    if (emission.w >= 0.0) emission.rgb *= image_color(emission.w, hit);
#endif
    vec3 radiance = emission.rgb + base.rgb * u_ambient;
#ifdef LIGHTS
    vec4 gloss = texel(u_materials, 3 * hit.material + 2);
    radiance += lit(hit, base.rgb, gloss.x, gloss.y);
#endif
    return vec4(radiance, 1.0);
}
