#version 330 core
// Directional lights reach every pixel.
#include "include/proxy.glsl"
#record DirectionalLight

void main()
{
    send_light();
    gl_Position = fullscreen_corner();
}
