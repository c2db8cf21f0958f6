// Provides power_encoded, power_decoded and srgb_to_linear, for the look "pyrender": display values by the power 1/2.2,
// and sRGB (IEC 61966-2-1) for textures whose codes are filtered before they are decoded.
// Float64 twin: firefly_sample/lab/reference/shading.py

vec3 power_encoded(vec3 radiance)
{
    return pow(clamp(radiance, 0.0, 1.0), vec3(1.0 / 2.2));
}

vec3 power_decoded(vec3 code)
{
    return pow(code, vec3(2.2));
}

vec3 srgb_to_linear(vec3 code)
{
    vec3 high = pow((code + 0.055) / 1.055, vec3(2.4));
    return mix(high, code / 12.92, vec3(lessThanEqual(code, vec3(0.04045))));
}
