#version 330 core
// Adds point lights to the surfaces that they reach.
#define PLACED 1
#include "include/surface.glsl"
#record PointLight
#include "include/reach.glsl"

bool arrives(Surface s, Light light, out vec3 to_light, out float strength)
{
    return in_reach(s, light, to_light, strength);
}

#include "include/light_pass.glsl"
