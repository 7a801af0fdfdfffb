// Provides the lights. Three texels a light: position and kind; power and the spot's cosine at its edge; direction and
// the spot's cosine where its full intensity begins. Power is already the intensity (per steradian, in model lengths
// squared) or, for a sun, the irradiance: addon/core/textures.py does the arithmetic.

const float POINT = 0.0;
const float SUN = 1.0;
const float SPOT = 2.0;
const float AREA = 3.0;

uniform sampler2D u_lights;
uniform int u_light_count;

int light_count() {
    return u_light_count;
}

Illumination light_at(int index, vec3 position) {
    vec4 place = texel(u_lights, 3 * index);
    vec4 power = texel(u_lights, 3 * index + 1);
    vec4 direction = texel(u_lights, 3 * index + 2);
    if (place.w == SUN) return Illumination(power.rgb, -direction.xyz);
    vec3 to_light = place.xyz - position;
    float distance_squared = max(dot(to_light, to_light), 1e-12);
    vec3 towards = to_light * inversesqrt(distance_squared);
    vec3 irradiance = power.rgb / distance_squared;
    float cosine = -dot(towards, direction.xyz);
    if (place.w == SPOT) irradiance *= smoothstep(power.w, max(direction.w, power.w + 1e-6), cosine);
    if (place.w == AREA) irradiance *= max(cosine, 0.0);
    return Illumination(irradiance, towards);
}
