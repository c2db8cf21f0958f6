#version 330 core
// Writes the G-buffer: each output exists only where the frame has its target.
#include "include/gbuffer.glsl"

in vec3 v_view;
in vec3 v_normal;
in vec2 v_texcoord;
#if VERTEX_COLOR
in vec3 v_color;
#endif
flat in uint v_id;

uniform vec4 u_base_color;
#if CUTOUT
uniform float u_alpha_cutoff;
#endif
#if TEXTURED
uniform sampler2D u_texture;
#endif

#if ALBEDO
out vec4 o_albedo;
#endif
#if NORMAL
out vec4 o_normal;
#endif
#if DISTANCE
out float o_distance;
#endif
#if ID
out uint o_id;
#endif

void main()
{
    vec4 base = u_base_color;
#if TEXTURED
    base *= texture(u_texture, v_texcoord);
#endif
#if VERTEX_COLOR
    base.rgb *= v_color;
#endif
#if CUTOUT
    if (base.a < u_alpha_cutoff)
        discard;
#endif
#if ALBEDO
    o_albedo = vec4(encode_albedo(base.rgb), 1.0);  // alpha marks what was drawn
#endif
#if NORMAL
    vec3 n = normalize(v_normal);
#if DOUBLE_SIDED
#if ORTHOGRAPHIC
    n = n.y > 0.0 ? -n : n;
#else
    n = dot(n, v_view) > 0.0 ? -n : n;  // turned towards the eye
#endif
#endif
    o_normal = encode_normal(n);
#endif
#if DISTANCE
    o_distance = v_view.y;
#endif
#if ID
    o_id = v_id;
#endif
}
