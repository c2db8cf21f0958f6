// Provides Light and arrives, which says whether a light comes to a surface, from where, and how much of it.
// KIND 1: directional lights. KIND 2: point lights. KIND 3: spotlights; diffuse light and highlights fade alike.
#include "include/phong.glsl"
#include "include/rests.glsl"
#if KIND == 1
#record DirectionalLight
#elif KIND == 2
#record PointLight
#else
#record Spotlight
#include "include/cone.glsl"
#endif

#if KIND == 1

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
#if KIND == 3
    strength *= cone_strength(to_light, light.axis, light.cone);
#endif
    return strength > 0.0;
}

#endif
