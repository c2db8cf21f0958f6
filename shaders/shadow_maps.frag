#version 330 core
// Writes depth only, and discards what is cut out by the alpha of textures or of vertices.
#include "include/caster_maps.glsl"

#if CUTOUT
flat in float v_alpha;
uniform float u_alpha_cutoff;
#endif
#if TEXCOORDS
in vec2 v_texcoord;
#endif
#if TEXTURED
uniform sampler2D u_texture;
#endif
#if MODULATE_MAP
uniform sampler2D u_modulate_texture;
#endif
#if MODULATE_MAP == 2
in vec2 v_texcoord_1;
#endif
#if VERTEX_ALPHA
in float v_vertex_alpha;
#endif

void main()
{
#if CUTOUT
    float alpha = v_alpha;
#if TEXTURED
    alpha *= texture(u_texture, v_texcoord).a;
#endif
#if MODULATE_MAP == 2
    alpha *= texture(u_modulate_texture, v_texcoord_1).a;
#elif MODULATE_MAP
    alpha *= texture(u_modulate_texture, v_texcoord).a;
#endif
#if VERTEX_ALPHA
    alpha *= v_vertex_alpha;
#endif
    if (alpha < u_alpha_cutoff)
        discard;
#endif
}
