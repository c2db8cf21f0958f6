#version 330 core
// Adds point lights to the surfaces that they reach.
#define PLACED 1
#include "include/surface.glsl"
#include "include/falloff.glsl"
#include "include/shine.glsl"
#if TAPS
#include "include/shadow.glsl"
#endif
#record PointLight

void light_surface(Surface s, Light light)
{
    vec3 way = way_to_light(s, light.place, light.pixel, light.color.w);
    float d2 = dot(way, way);
    if (d2 >= light.place.w * light.place.w)
        return;
    float d = sqrt(max(d2, 1e-30));  // a light on the surface stays finite
    vec3 to_light = way / d;
    float n_dot_l = dot(s.normal, to_light);
    if (n_dot_l <= 0.0)
        return;
#if FALLOFF == 0
    float strength = falloff(d, light.place.w);
#else
    float strength = falloff(d, light.fade);
#endif
#if TAPS
    strength *= shadow(s, to_light, n_dot_l, light.shadow);
#endif
#if HIGHLIGHTS
    add_light(s, to_light, n_dot_l, strength, light.color.rgb, light.specular.rgb);
#else
    add_light(s, to_light, n_dot_l, strength, light.color.rgb, vec3(0.0));
#endif
}

#include "include/light_pass.glsl"
