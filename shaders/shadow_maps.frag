#version 330 core
// Writes depth only, and discards what is cut out by the alpha of a texture or of vertices.
#define CUTOUT (TEXTURED || VERTEX_ALPHA)

#if CUTOUT
flat in float v_alpha;
uniform float u_alpha_cutoff;
#endif
#if TEXTURED
in vec2 v_texcoord;
uniform sampler2D u_texture;
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
#if VERTEX_ALPHA
    alpha *= v_vertex_alpha;
#endif
    if (alpha < u_alpha_cutoff)
        discard;
#endif
}
