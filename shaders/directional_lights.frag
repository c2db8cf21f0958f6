#version 330 core
// Adds directional lights, which reach every surface. Where it is matters only for its shadows.
#define PLACED (TAPS > 0)
#include "include/surface.glsl"
#record DirectionalLight

bool arrives(Surface s, Light light, out vec3 to_light, out float strength)
{
    to_light = -light.axis.xyz;
    strength = 1.0;
    return true;
}

#include "include/light_pass.glsl"
