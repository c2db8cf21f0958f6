#version 330 core
// Draws the proxies of point lights: a light is shaded at the pixels that its proxy covers. See include/proxy.glsl.
#include "include/proxy.glsl"
#record PointLight

#if LIGHT_METHOD == LIGHT_METHOD_SPHERE
in vec3 in_position;
#endif

void main()
{
    send_light();
#if LIGHT_METHOD == LIGHT_METHOD_SPHERE
    gl_Position = on_sphere(in_place, in_position);
#else
    gl_Position = fullscreen_corner();
#endif
}
