#version 330 core
// Adds directional lights, which reach every surface. Where it is matters only for its shadows.
#define PLACED (TAPS > 0)
#include "include/surface.glsl"
#include "include/shine.glsl"
#if TAPS
#include "include/shadow.glsl"
#endif
#record DirectionalLight

void light_surface(Surface s, Light light)
{
    vec3 to_light = -light.axis.xyz;
    float n_dot_l = dot(s.normal, to_light);
    if (n_dot_l <= 0.0)
        return;
    float strength = 1.0;
#if TAPS
    strength = shadow(s, to_light, n_dot_l, light.shadow);
#endif
#if HIGHLIGHTS
    add_light(s, to_light, n_dot_l, strength, light.color.rgb, light.specular.rgb);
#else
    add_light(s, to_light, n_dot_l, strength, light.color.rgb, vec3(0.0));
#endif
}

#include "include/light_pass.glsl"
