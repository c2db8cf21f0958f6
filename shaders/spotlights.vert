#version 330 core
// Draws the proxies of spotlights: a light is shaded at the pixels that its proxy covers. See include/proxy.glsl.
#include "include/proxy.glsl"
#record Spotlight

#if LIGHT_METHOD == LIGHT_METHOD_SPHERE || LIGHT_METHOD == LIGHT_METHOD_CONE
in vec3 in_position;
#endif

void main()
{
    send_light();
#if LIGHT_METHOD == LIGHT_METHOD_SPHERE
    gl_Position = on_sphere(in_place, in_position);
#elif LIGHT_METHOD == LIGHT_METHOD_CONE
    gl_Position = on_cone(in_place.xyz, in_axis.xyz, in_cone.z, in_cone.w, in_position);
#else
    gl_Position = fullscreen_corner();
#endif
}
