// Provides in_reach: the way to a light that has a place, and how much of it fading leaves. For after #record.
#include "include/falloff.glsl"

bool in_reach(Surface s, Light light, out vec3 to_light, out float strength)
{
    vec3 way = way_to_light(s, light.place, light.pixel, light.color.w);
    float d2 = dot(way, way);
    if (d2 >= light.place.w * light.place.w)
        return false;
    float d = sqrt(max(d2, 1e-37));  // a light on the surface stays finite; below, float32 holds no digits
    to_light = way * (1.0 / d);  // one division and not three
#if FALLOFF == FALLOFF_RAMP_SQUARED
    strength = falloff(d, light.place.w);
#else
    strength = falloff(d, light.fade);
#endif
    return true;
}
