#version 330 core
// Places one instance's vertices in view space. Matrices arrive as columns, made in float64.
#include "include/lens.glsl"

in vec3 in_position;
in vec3 in_normal;
in vec2 in_texcoord;
#if VERTEX_COLOR
in vec3 in_color;
#endif
in vec4 in_view_x;
in vec4 in_view_y;
in vec4 in_view_z;
in vec3 in_normal_x;
in vec3 in_normal_y;
in vec3 in_normal_z;
in uint in_id;

out vec3 v_view;
out vec3 v_normal;
out vec2 v_texcoord;
#if VERTEX_COLOR
out vec3 v_color;
#endif
flat out uint v_id;

void main()
{
    vec4 p = vec4(in_position, 1.0);
    v_view = vec3(dot(p, in_view_x), dot(p, in_view_y), dot(p, in_view_z));
    v_normal = vec3(dot(in_normal, in_normal_x), dot(in_normal, in_normal_y), dot(in_normal, in_normal_z));
    v_texcoord = in_texcoord;
#if VERTEX_COLOR
    v_color = in_color;
#endif
    v_id = in_id;
    gl_Position = view_to_clip(v_view);
}
