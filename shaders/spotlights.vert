#version 330 core
// Where spotlights are shaded; see include/proxy.glsl.
#include "include/proxy.glsl"
#record Spotlight

#if METHOD == 0 || METHOD == 1
in vec3 in_position;
#endif

void main()
{
    send_light();
#if METHOD == 0
    gl_Position = on_sphere(in_place, in_position);
#elif METHOD == 1
    gl_Position = on_cone(in_place.xyz, in_axis.xyz, in_cone.z, in_cone.w, in_position);
#else
    gl_Position = fullscreen_corner();
#endif
}
