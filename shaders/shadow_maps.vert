#version 330 core
// Places one instance's vertices as a light sees them. Matrices arrive as columns, made in float64.

in vec3 in_position;
in vec4 in_clip_x;
in vec4 in_clip_y;
in vec4 in_clip_z;
in vec4 in_clip_w;
#if CUTOUT
in vec2 in_texcoord;
in float in_alpha;
out vec2 v_texcoord;
flat out float v_alpha;
#endif

void main()
{
    vec4 p = vec4(in_position, 1.0);
    gl_Position = vec4(dot(p, in_clip_x), dot(p, in_clip_y), dot(p, in_clip_z), dot(p, in_clip_w));
#if CUTOUT
    v_texcoord = in_texcoord;
    v_alpha = in_alpha;
#endif
}
