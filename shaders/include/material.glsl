// Provides Sample; sample_material: the material of a triangle at a pixel, which discards what alpha cuts out;
// surface_view and surface_normal.
#include "include/lens.glsl"
#include "include/unit_normal.glsl"

in vec3 v_view;
in vec3 v_normal;
in vec2 v_texcoord;
#if VERTEX_COLOR
in vec3 v_color;
#endif
#if VERTEX_ALPHA
in float v_vertex_alpha;
#endif
flat in vec4 v_base_color;
#if AMBIENT_ALBEDO
flat in vec3 v_ambient;
#endif
#if SPECULAR
flat in vec4 v_specular;
#endif
#if EMISSION
flat in vec3 v_emission;
#endif
#if SECOND_TEXCOORDS
in vec2 v_texcoord_1;
#endif

#if CUTOUT
uniform float u_alpha_cutoff;
#endif
#if TEXTURED
uniform sampler2D u_texture;
#endif
#if EMISSION_TEXTURED
uniform sampler2D u_emission_texture;
#endif

struct Sample {
    vec3 albedo;
    vec3 ambient;  // reflectance of ambient light
#if EMISSION
    vec3 emission;
#endif
};

Sample sample_material()
{
    Sample made;
#if EMISSION
    made.emission = v_emission;
#if EMISSION_TEXTURED
    // before discard, after which the mipmap level is undefined
#if SECOND_TEXCOORDS
    made.emission *= texture(u_emission_texture, v_texcoord_1).rgb;
#else
    made.emission *= texture(u_emission_texture, v_texcoord).rgb;
#endif
#endif
#endif
    vec4 tint = vec4(1.0);
#if TEXTURED
    tint = texture(u_texture, v_texcoord);
#endif
#if VERTEX_COLOR
    tint.rgb *= v_color;
#endif
#if VERTEX_ALPHA
    tint.a *= v_vertex_alpha;
#endif
    vec4 base = v_base_color * tint;
#if CUTOUT
    if (base.a < u_alpha_cutoff)
        discard;
#endif
    // a surface reflects at most all light, even if the product of colours is larger
    made.albedo = clamp(base.rgb, 0.0, 1.0);
#if AMBIENT_ALBEDO
    made.ambient = clamp(v_ambient * tint.rgb, 0.0, 1.0);
#else
    made.ambient = made.albedo;
#endif
    return made;
}

// If a triangle's projected corners lie on a line, a rasterizer may interpolate NaN. Such a pixel gets a position on
// the near plane instead, so that every later value is a number.
vec3 surface_view()
{
#if INTERPOLATION == INTERPOLATION_FLOAT64
    // the pixel's ray is exact; a NaN counts as steep and is recomputed
    return view_from_distance(ndc_from_pixel(gl_FragCoord.xy), v_view.y);
#else
    return abs(v_view.y) < 1e37 ? v_view : vec3(0.0, u_pixel.z, 0.0);
#endif
}

// Panda3D's sample, NORMAL_FORMAT_CLASSIC, leaves normals as they are where the back of a surface is seen.
vec3 surface_normal(vec3 view)
{
    return unit_normal(v_normal, view, DOUBLE_SIDED != 0 && NORMAL_FORMAT != NORMAL_FORMAT_CLASSIC);
}
