// Provides Light and arrives: whether a light reaches a surface, from which direction, and with what strength.
// LIGHT_KIND_DIRECTIONAL, LIGHT_KIND_POINT, LIGHT_KIND_SPOT; diffuse light and highlights fade alike.
#include "include/phong.glsl"
#include "include/rests.glsl"
#if LIGHT_KIND == LIGHT_KIND_DIRECTIONAL
#record DirectionalLight
#elif LIGHT_KIND == LIGHT_KIND_POINT
#record PointLight
#else
#record Spotlight
#include "include/cone.glsl"
#endif

#if LIGHT_KIND == LIGHT_KIND_DIRECTIONAL

bool arrives(Surface s, Light light, out vec3 to_light, out float strength)
{
    to_light = -light.axis.xyz;
    strength = 1.0;
    return true;
}

#else

#include "include/reach.glsl"

bool arrives(Surface s, Light light, out vec3 to_light, out float strength)
{
    if (!in_reach(s, light, to_light, strength))
        return false;
#if LIGHT_KIND == LIGHT_KIND_SPOT
    strength *= cone_strength(to_light, light.axis, light.cone);
#endif
    return strength > 0.0;
}

#endif
