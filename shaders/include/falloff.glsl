// FALLOFF 0 is Falloff.RAMP_SQUARED. Provides falloff: how a point light fades with distance. Exactly 0 from the radius on.
// Float64 twin: firefly_sample/reference/falloff.py

float falloff(float d, float radius)
{
#if FALLOFF == 0
    float s = max(1.0 - d / radius, 0.0);
    return s * s;
#else
#error "this falloff has no code"
#endif
}
