#version 330 core
// Adds spotlights to the surfaces within their cones and their reach. Diffuse light and highlights fade alike.
#define PLACED 1
#include "include/surface.glsl"
#include "include/cone.glsl"
#record Spotlight
#include "include/reach.glsl"

bool arrives(Surface s, Light light, out vec3 to_light, out float strength)
{
    if (!in_reach(s, light, to_light, strength))
        return false;
    strength *= cone_strength(to_light, light.axis, light.cone);
    return strength > 0.0;
}

#include "include/light_pass.glsl"
