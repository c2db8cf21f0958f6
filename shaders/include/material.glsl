// Provides Sample and sample_material: what a triangle is made of behind a pixel. Discards what is cut out.

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

#if CUTOUT
uniform float u_alpha_cutoff;
#endif
#if TEXTURED
uniform sampler2D u_texture;
#endif

struct Sample {
    vec3 albedo;
    vec3 ambient;  // reflectance of ambient light
};

Sample sample_material()
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
    // a surface reflects no more than all light, whatever colours are multiplied
    vec3 albedo = clamp(base.rgb, 0.0, 1.0);
#if AMBIENT
    return Sample(albedo, clamp(v_ambient * tint.rgb, 0.0, 1.0));
#else
    return Sample(albedo, albedo);
#endif
}

// Unit normal. One without a length faces the eye: a surface must not become a hole.
vec3 surface_normal()
{
#if ORTHOGRAPHIC
    vec3 ahead = vec3(0.0, 1.0, 0.0);
#else
    vec3 ahead = v_view / max(length(v_view), 1e-30);
#endif
    float length2 = dot(v_normal, v_normal);
    vec3 n = length2 > 1e-30 ? v_normal * inversesqrt(length2) : -ahead;
#if DOUBLE_SIDED
    n = dot(n, ahead) > 0.0 ? -n : n;  // turned towards the eye
#endif
    return n;
}
