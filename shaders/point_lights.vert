#version 330 core
// METHOD 0: one sphere a light, circumscribed so that its flat faces miss nothing.
// METHOD 1: one full-screen triangle a light. METHOD 2: one full-screen triangle for all.
#include "include/lens.glsl"

#if METHOD == 0
in vec3 in_position;
#endif
#if METHOD != 2
in vec4 in_light;  // centre in view space, radius
in vec3 in_color;
in vec3 in_rest;   // what float32 took from the centre
flat out vec4 v_light;
flat out vec3 v_color;
flat out vec3 v_rest;
#endif

void main()
{
#if METHOD != 2
    v_light = in_light;
    v_color = in_color;
    v_rest = in_rest;
#endif
#if METHOD == 0
    gl_Position = view_to_clip(in_light.xyz + in_light.w * in_position);
#else
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
#endif
}
