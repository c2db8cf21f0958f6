// Provides falloff: how a light fades with the distance d from it.
// FALLOFF_RAMP_SQUARED: (1 - d/reach)^2, exactly 0 from the reach on.
// FALLOFF_ATTENUATION: 1/(x + y*d + z*d^2) of fade, times a window that ends at 1/fade.w; none where that
// is 0. The fraction is at most 1e30: infinity times a colour of 0 would be NaN.
// RANGE_FALLOFF_KARIS: (1 - (d/R)^4)^2. RANGE_FALLOFF_GLTF: 1 - (d/R)^4.
// Float64 twin: firefly_sample/lab/reference/shading.py

#if FALLOFF == FALLOFF_RAMP_SQUARED
float falloff(float d, float reach)
{
    float s = max(1.0 - d / reach, 0.0);
    return s * s;
}
#elif FALLOFF == FALLOFF_ATTENUATION
float falloff(float d, vec4 fade)
{
    float s = d * fade.w;
    float window = max(1.0 - (s * s) * (s * s), 0.0);
#if RANGE_FALLOFF == RANGE_FALLOFF_KARIS
    window *= window;
#endif
    return window / max(fade.x + d * (fade.y + d * fade.z), 1e-30);
}
#else
#error "this falloff has no code"
#endif
