#version 330 core
// Writes the G-buffer. Each output is declared only if the frame has its target.
#include "include/gbuffer.glsl"
#include "include/material.glsl"
#include "include/steep.glsl"

#if ID
flat in uint v_id;
#endif
#if VISIBILITY
flat in uint v_instance;
#endif

#if ALBEDO
out COLOR_TEXEL o_albedo;
#endif
#if NORMAL
out vec4 o_normal;
#endif
#if DISTANCE
out float o_distance;
#endif
#if POSITION_TARGET != POSITION_TARGET_NONE
out vec4 o_position;
#endif
#if AMBIENT_ALBEDO
out COLOR_TEXEL o_ambient;
#endif
#if SPECULAR
out vec4 o_specular;
#endif
#ifdef METALLIC_ROUGHNESS
out vec4 o_metallic_roughness;
#endif
#if defined(TINT) && defined(PANDA3D)
out vec4 o_tint;
#elif defined(TINT)
out COLOR_TEXEL o_tint;
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

#if INTERPOLATION == INTERPOLATION_FLOAT64
// Largest relative change of a value from one pixel to the next for which the rasterizer's interpolation is used.
// Sample positions may be off by up to 1/512 pixel on a GPU, and by less than 1/10,000 on llvmpipe. Below this limit,
// the error of interpolation is at most 2e-6.
const float STEEP = 1.0 / 1024.0;

bool is_steep()
{
    vec3 n = fwidth(v_normal);
    // written so that NaN counts as steep
    return !(dot(n, n) <= STEEP * STEEP * dot(v_normal, v_normal) && fwidth(v_view.y) <= STEEP * abs(v_view.y));
}
#endif

void main()
{
#if INTERPOLATION == INTERPOLATION_FLOAT64
#if NORMAL_MAP
    uint steep = 0u;  // the interpolation pass has no normal maps
#else
    uint steep = is_steep() ? STEEP_BIT : 0u;  // before discard, after which derivatives are undefined
#endif
#endif
    Sample made = sample_material();
#if NORMAL || DISTANCE || POSITION_TARGET != POSITION_TARGET_NONE
    vec3 view = surface_view();
#endif
#if ALBEDO
    o_albedo = pack_color(made.albedo);
#endif
#if NORMAL
    o_normal = encode_normal(surface_normal(view, made));
#endif
#if DISTANCE
    o_distance = view.y;
#endif
#if POSITION_TARGET == POSITION_TARGET_FLOAT32
    o_position = vec4(view, 1.0);
#elif POSITION_TARGET == POSITION_TARGET_FLOAT16
    o_position = vec4(clamp(view, -65504.0, 65504.0), 1.0);  // the largest half float
#endif
#if AMBIENT_ALBEDO
    o_ambient = pack_color(made.ambient);
#endif
#if SPECULAR && defined(METALLIC)
    o_specular = encode_specular(vec3(0.0), 0.0);
#elif SPECULAR
    o_specular = encode_specular(v_specular.rgb, v_specular.a);
#ifdef LOCAL_VIEWERS
#ifdef LOCAL_VIEWER
    o_specular.a = encode_viewer(o_specular.a, true);
#else
    o_specular.a = encode_viewer(o_specular.a, false);
#endif
#endif
#endif
#ifdef METALLIC_ROUGHNESS
#ifdef METALLIC
    o_metallic_roughness = vec4(encode_metallic(made.metallic, made.roughness), 0.0, 0.0);
#else
    o_metallic_roughness = vec4(0.0);
#endif
#endif
#if defined(TINT) && defined(PANDA3D)
    o_tint = vec4(min(made.tint, LARGEST_HALF), 1.0);
#elif defined(TINT)
    o_tint = pack_color(made.tint);
#endif
#if EMISSION
    o_emission = vec4(made.emission, 1.0);
#endif
#if ID
    o_id = v_id;
#endif
#if VISIBILITY
    o_visibility = uvec2(v_instance, uint(gl_PrimitiveID));
#if INTERPOLATION == INTERPOLATION_FLOAT64
    o_visibility.y |= steep;
#endif
#endif
}
