// Provides Sample; sample_material: the material of a triangle at a pixel, which discards what alpha cuts out;
// surface_view and surface_normal.
// PYRENDER: textures hold codes of sRGB. BY_PYRENDER: emission is squared, and vertex colours and occlusion multiply what a
// surface shows. BY_PANDA3D: the texture and the colour scale multiply what is shown, once all light is added up.
#include "include/lens.glsl"
#include "include/surface_maps.glsl"
#include "include/unit_normal.glsl"
#ifdef METALLIC
#include "include/metallic.glsl"
#endif
#ifdef PYRENDER
#include "include/codes.glsl"
#endif

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
#if SPECULAR || defined(METALLIC)
flat in vec4 v_specular;
#endif
#if NORMAL_MAP && !BY_PYRENDER
in vec4 v_tangent;
#endif
#if EMISSION
flat in vec3 v_emission;
#endif
#if TEXCOORDS_1
in vec2 v_texcoord_1;
#endif
#ifdef SCALED
flat in vec3 v_color_scale;
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
#if METALLIC_MAP
uniform sampler2D u_metallic_texture;
#endif
#if NORMAL_MAP
uniform sampler2D u_normal_texture;
uniform float u_normal_scale;
uniform float u_handedness;  // -1 if the instances are mirrored
#endif
#if OCCLUSION_MAP
uniform sampler2D u_occlusion_texture;
uniform float u_occlusion_strength;
#endif
#if MODULATE_MAP
uniform sampler2D u_modulate_texture;
#endif

struct Sample {
    vec3 albedo;
#ifdef TRANSPARENCY
    float alpha;
#endif
    vec3 ambient;  // reflectance of ambient light
#if defined(PYRENDER) || defined(PANDA3D)
    vec3 tint;     // multiplies all light that is reflected; PANDA3D: all that is shown but highlights
#endif
#if EMISSION
    vec3 emission;
#endif
#if NORMAL_MAP
    vec3 bump;     // the normal in tangent space
#if BY_PYRENDER
    vec3 along;    // the direction in which the first texture coordinate grows, of any length; 0 without one
#endif
#endif
#ifdef METALLIC
    float metallic;
    float roughness;
#endif
};

#if NORMAL_MAP && BY_PYRENDER
// Returns the direction in which the first of two texture coordinates grows.
vec3 direction_of(vec2 texcoord)
{
    vec2 right = dFdx(texcoord), up = dFdy(texcoord);
    float turn = right.x * up.y - up.x * right.y;
    return (up.y * dFdx(v_view) - right.y * dFdy(v_view)) * sign(turn);
}
#endif

Sample sample_material()
{
    Sample made;
#if EMISSION
    made.emission = v_emission;
#if EMISSION_TEXTURED
    // before discard, after which the mipmap level is undefined
#if SECOND_TEXCOORDS
    vec3 glow = texture(u_emission_texture, v_texcoord_1).rgb;
#else
    vec3 glow = texture(u_emission_texture, v_texcoord).rgb;
#endif
#ifdef PYRENDER
    glow = srgb_to_linear(glow);
#endif
    made.emission *= glow;
#endif
#if BY_PYRENDER
    made.emission *= v_emission;
#endif
#endif
    // textures are sampled before discard, after which the mipmap level is undefined
#if NORMAL_MAP == 2
    made.bump = texture(u_normal_texture, v_texcoord_1).xyz * 2.0 - 1.0;
#elif NORMAL_MAP
    made.bump = texture(u_normal_texture, v_texcoord).xyz * 2.0 - 1.0;
#endif
#if BY_PYRENDER && NORMAL_MAP == 2
    made.along = direction_of(v_texcoord_1);
#elif BY_PYRENDER && NORMAL_MAP
    made.along = direction_of(v_texcoord);
#endif
#if OCCLUSION_MAP == 2
    float occlusion = texture(u_occlusion_texture, v_texcoord_1).r;
#elif OCCLUSION_MAP
    float occlusion = texture(u_occlusion_texture, v_texcoord).r;
#endif
#ifdef METALLIC
    made.metallic = v_specular.x;
    made.roughness = v_specular.y;
#if METALLIC_MAP == 2
    vec4 factors = texture(u_metallic_texture, v_texcoord_1);
#elif METALLIC_MAP
    vec4 factors = texture(u_metallic_texture, v_texcoord);
#endif
#if METALLIC_MAP
    made.metallic *= factors.b;
    made.roughness *= factors.g;
#endif
#endif
    vec4 tint = vec4(1.0);
#if TEXTURED
    tint = texture(u_texture, v_texcoord);
#ifdef PYRENDER
    tint.rgb = srgb_to_linear(tint.rgb);
#endif
#endif
#if MODULATE_MAP == 2
    vec4 second = texture(u_modulate_texture, v_texcoord_1);
#elif MODULATE_MAP
    vec4 second = texture(u_modulate_texture, v_texcoord);
#endif
#if MODULATE_MAP && defined(PYRENDER)
    second.rgb = srgb_to_linear(second.rgb);
#endif
#if MODULATE_MAP
    tint *= second;
#endif
#ifdef PYRENDER
    made.tint = vec3(1.0);
#endif
#ifdef PANDA3D
#ifdef SCALED
    vec3 scale = v_color_scale;
#else
    const vec3 scale = vec3(1.0);
#endif
#if BY_PANDA3D
    made.tint = tint.rgb * scale;
    tint.rgb = vec3(1.0);
#else
    made.tint = vec3(1.0);
    tint.rgb *= scale;
#if EMISSION
    made.emission *= scale;
#endif
#endif
#endif
#if VERTEX_COLOR && BY_PYRENDER
    made.tint = v_color;
#if EMISSION
    made.emission *= v_color;
#endif
#elif VERTEX_COLOR
    tint.rgb *= v_color;
#endif
#if VERTEX_ALPHA
    tint.a *= v_vertex_alpha;
#endif
    vec4 base = v_base_color * tint;
#ifdef TRANSPARENCY
    made.alpha = base.a;
#endif
#if CUTOUT
    if (base.a < u_alpha_cutoff)
        discard;
#endif
    // a surface reflects at most all light, even if the product of colours is larger
    made.albedo = clamp(base.rgb, 0.0, 1.0);
#if defined(METALLIC)
    made.ambient = ambient_reflectance(made.albedo, made.metallic);
#elif AMBIENT_ALBEDO
    made.ambient = clamp(v_ambient * tint.rgb, 0.0, 1.0);
#else
    made.ambient = made.albedo;
#endif
#if OCCLUSION_MAP && BY_PYRENDER
    made.tint *= 1.0 + u_occlusion_strength * (occlusion - 1.0);
#elif OCCLUSION_MAP
    made.ambient *= 1.0 + u_occlusion_strength * (occlusion - 1.0);
#endif
#ifdef UNLIT
#if EMISSION
    made.emission = made.albedo;
#endif
    made.albedo = vec3(0.0);
    made.ambient = vec3(0.0);
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

// Panda3D, also its sample, NORMAL_FORMAT_CLASSIC, and pyrender leave normals as they are where the back of a surface is
// seen.
// BY_PYRENDER: a normal map lies along the texture coordinates, as if these were not mirrored.
vec3 surface_normal(vec3 view, Sample made)
{
#if BY_PYRENDER
    vec3 n = unit_normal(v_normal, view, false);
#if NORMAL_MAP
    vec3 t = made.along - n * dot(n, made.along);
    float length2 = dot(t, t);
    if (!(length2 > 1e-37))
        return n;
    t *= inversesqrt(length2);
    vec3 mapped = made.bump.x * t + made.bump.y * cross(n, t) + made.bump.z * n;
    float square = dot(mapped, mapped);
    return square > 1e-30 ? mapped * inversesqrt(square) : n;
#else
    return n;
#endif
#else
    const bool two_sided = DOUBLE_SIDED != 0 && NORMAL_FORMAT != NORMAL_FORMAT_CLASSIC && BY_PANDA3D == 0;
#if NORMAL_MAP
    // tangent, bitangent and normal are unit vectors; the back of a surface has all three turned
    vec3 n = unit_normal(v_normal, view, false);
    vec3 facing = unit_normal(v_normal, view, two_sided);
    float length2 = dot(v_tangent.xyz, v_tangent.xyz);
    if (length2 < 1e-30)
        return facing;
    vec3 t = v_tangent.xyz * inversesqrt(length2);
    vec3 b = cross(n, t) * (v_tangent.w < 0.0 ? -u_handedness : u_handedness);
    vec3 bump = vec3(made.bump.xy * u_normal_scale, made.bump.z);
    vec3 mapped = bump.x * t + bump.y * b + bump.z * n;
    float square = dot(mapped, mapped);
    return square > 1e-30 ? mapped * (inversesqrt(square) * (dot(n, facing) < 0.0 ? -1.0 : 1.0)) : facing;
#else
    return unit_normal(v_normal, view, two_sided);
#endif
#endif
}
