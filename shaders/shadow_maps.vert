#version 330 core
// Transforms an instance's vertices to a light's view. Matrices are computed in float64 and given as columns.
#include "include/caster_maps.glsl"

in vec3 in_position;
in vec4 in_clip_x;
in vec4 in_clip_y;
in vec4 in_clip_z;
in vec4 in_clip_w;
#if CUTOUT
in float in_alpha;
flat out float v_alpha;
#endif
#if MODULATE_MAP == 2
in vec4 in_texcoord;  // both pairs
out vec2 v_texcoord_1;
#elif TEXCOORDS
in vec2 in_texcoord;
#endif
#if TEXCOORDS
out vec2 v_texcoord;
#endif
#if VERTEX_ALPHA
in vec4 in_color;
out float v_vertex_alpha;
#endif

void main()
{
    vec4 p = vec4(in_position, 1.0);
    gl_Position = vec4(dot(p, in_clip_x), dot(p, in_clip_y), dot(p, in_clip_z), dot(p, in_clip_w));
#if CUTOUT
    v_alpha = in_alpha;
#endif
#if TEXCOORDS
    v_texcoord = in_texcoord.xy;
#endif
#if MODULATE_MAP == 2
    v_texcoord_1 = in_texcoord.zw;
#endif
#if VERTEX_ALPHA
    v_vertex_alpha = in_color.a;
#endif
}
