#version 330 core
// Writes the G-buffer: each output exists only where the frame has its target.
#include "include/gbuffer.glsl"

in vec3 v_view;
in vec3 v_normal;
in vec2 v_texcoord;
#if VERTEX_COLOR
in vec3 v_color;
#endif
flat in vec4 v_base_color;
#if AMBIENT
flat in vec3 v_ambient;
#endif
#if SPECULAR
flat in vec4 v_specular;
#endif
#if EMISSION
flat in vec3 v_emission;
#endif
#if ID
flat in uint v_id;
#endif
#if VISIBILITY
flat in uint v_instance;
#endif

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
#if AMBIENT
out vec4 o_ambient;
#endif
#if SPECULAR
out vec4 o_specular;
#endif
#if EMISSION
out vec4 o_emission;
#endif
#if ID
out uint o_id;
#endif
#if VISIBILITY
out uvec2 o_visibility;
#endif

void main()
{
    vec4 tint = vec4(1.0);
#if TEXTURED
    tint = texture(u_texture, v_texcoord);
#endif
#if VERTEX_COLOR
    tint.rgb *= v_color;
#endif
    vec4 base = v_base_color * tint;
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
#if AMBIENT
    o_ambient = vec4(encode_albedo(v_ambient * tint.rgb), 1.0);
#endif
#if SPECULAR
    o_specular = encode_specular(v_specular.rgb, v_specular.a);
#endif
#if EMISSION
    o_emission = vec4(v_emission, 1.0);
#endif
#if ID
    o_id = v_id;
#endif
#if VISIBILITY
    o_visibility = uvec2(v_instance, uint(gl_PrimitiveID));
#endif
}
