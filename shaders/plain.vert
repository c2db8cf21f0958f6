#version 330 core
// A square that faces the camera around each dot, never smaller than a pixel: a dot that would be is drawn
// a pixel wide and as much fainter, so that it neither vanishes nor flickers.
#include "include/lens.glsl"

in vec2 in_corner;
in vec4 in_dot;  // centre in view space, radius
in vec3 in_color;
out vec2 v_corner;
flat out vec3 v_color;

const float SMALLEST = 1.0;  // radius in pixels

void main()
{
    vec4 center = view_to_clip(in_dot.xyz);
    float pixels = in_dot.w * u_projection.z * u_size.w / max(center.w, 1e-30);
    float grow = max(SMALLEST / max(pixels, 1e-30), 1.0);
    float radius = in_dot.w * grow;
    v_corner = in_corner;
    v_color = in_color / (grow * grow);
    gl_Position = view_to_clip(in_dot.xyz + radius * vec3(in_corner.x, 0.0, in_corner.y));
}
