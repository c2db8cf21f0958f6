// Provides in_reach: the direction to a light that has a position, and its strength after fading. Include it after
// #record.
#include "include/falloff.glsl"

bool in_reach(Surface s, Light light, out vec3 to_light, out float strength)
{
    vec3 way = way_to_light(s, light.place, light.pixel, light.color.w);
    float d2 = dot(way, way);
    if (d2 >= light.place.w * light.place.w)
        return false;
    float d = sqrt(max(d2, 1e-37));  // keeps a light on the surface finite; float32 has no digits below
    to_light = way * (1.0 / d);  // one division instead of three
#if FALLOFF == FALLOFF_RAMP_SQUARED
    strength = falloff(d, light.place.w);
#else
    strength = falloff(d, light.fade);
#endif
    return true;
}
