#version 330 core
// A square that faces the camera around each dot, never smaller than a pixel.
#include "include/lens.glsl"

in vec2 in_corner;
in vec4 in_dot;         // centre in view space, radius
in vec4 in_pixel;       // of the centre: two float32 each across and up
in vec2 in_per_radius;  // one over the radius in pixels, across and up
in vec3 in_color;
flat out vec4 v_pixel;
flat out vec2 v_per_radius;
flat out vec3 v_color;

void main()
{
    v_pixel = in_pixel;
    v_per_radius = in_per_radius;
    v_color = in_color;
    gl_Position = view_to_clip(in_dot.xyz + in_dot.w * vec3(in_corner.x, 0.0, in_corner.y));
}
