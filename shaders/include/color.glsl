// Provides linear_to_srgb (IEC 61966-2-1, the exact pieces) and tone_curve.
// TONE 0: clip at 1. TONE 1: 1 - exp(-L) in each channel; a series near 0, where the difference cancels.
// Float64 twin: firefly_sample/lab/reference/shading.py

vec3 linear_to_srgb(vec3 linear)
{
    vec3 x = clamp(linear, 0.0, 1.0);
    vec3 low = 12.92 * x;
    vec3 high = 1.055 * pow(max(x, vec3(1e-8)), vec3(1.0 / 2.4)) - 0.055;
    return mix(high, low, vec3(lessThanEqual(x, vec3(0.0031308))));
}

vec3 tone_curve(vec3 radiance)
{
    vec3 x = max(radiance, vec3(0.0));
#if TONE == TONE_EXPONENTIAL
    vec3 small = x * (1.0 - x * (0.5 - x / 6.0));
    return mix(1.0 - exp(-x), small, lessThan(x, vec3(0.01)));  // selects and does not blend: the series may overflow
#else
    return min(x, vec3(1.0));
#endif
}
