#version 330 core
// Only depth is written.

#if CUTOUT
in vec2 v_texcoord;
flat in float v_alpha;
uniform sampler2D u_texture;
uniform float u_alpha_cutoff;
#endif

void main()
{
#if CUTOUT
    if (v_alpha * texture(u_texture, v_texcoord).a < u_alpha_cutoff)
        discard;
#endif
}
