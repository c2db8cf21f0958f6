#version 330 core
// Shades blended surfaces when they are drawn, by all lights at once. The surfaces' alpha multiplies all that they show.
// PYRENDER and PANDA3D: what they show is codes, which are mixed.
// TRANSPARENCY_SORTED: for blending from back to front.
// TRANSPARENCY_WEIGHTED: a sum whose weights fall with the distance (McGuire, Bavoil, "Weighted Blended Order-Independent
// Transparency", JCGT 2(2), 2013).
// TRANSPARENCY_EXACT: one layer, the nearest behind the layer before (Everitt, "Interactive Order-Independent
// Transparency", NVIDIA, 2001). Of surfaces at the same depth, the one that is drawn first is the nearer one.
#define PLACED 1
#define ID 0
#define VISIBILITY 0
#define INTERPOLATION INTERPOLATION_RASTERIZER
#define POSITION_SOURCE POSITION_SOURCE_DISTANCE
#define LIGHT_RESOLUTION LIGHT_RESOLUTION_FULL
#define RADIANCE 1
#define NORMAL_FORMAT NORMAL_FORMAT_OCT16
#define ALBEDO_FORMAT ALBEDO_FORMAT_LINEAR
#define CUTOUT 0
#ifdef METALLIC
#define METALLIC_ROUGHNESS 1
#endif
#if defined(PANDA3D) && SPECULAR_MODEL != SPECULAR_MODEL_NONE
#define GLOSS 1
#endif
#include "include/surface.glsl"
#include "include/material.glsl"
#include "include/rests.glsl"
#include "include/cone.glsl"
#include "include/shine.glsl"
#include "include/sums.glsl"
#if SHADOW_TAPS
#include "include/shadow.glsl"
#endif
#if PARTICLE_SHADOW
#include "include/particle_shadow.glsl"
#endif
#light_sets "include/light_set.glsl"
#block Shading
#if TRANSPARENCY == TRANSPARENCY_WEIGHTED
#include "include/weight.glsl"
#endif

#if TRANSPARENCY == TRANSPARENCY_SORTED
out vec4 o_transparency;
#elif TRANSPARENCY == TRANSPARENCY_WEIGHTED
out vec4 o_transparency;
out float o_transparency_weight;
#else
flat in uint v_instance;
uniform sampler2D u_peeled_depth;    // of the layer before, as a depth buffer has it
uniform usampler2D u_peeled_number;  // instance and triangle there
#if SURFACES
uniform sampler2D u_depth;           // of opaque surfaces
uniform float u_depth_step;          // half a step of a depth buffer that rounds
#endif
out vec4 o_layer;
out vec2 o_layer_place;
out uvec2 o_layer_number;
#endif

#if TRANSPARENCY == TRANSPARENCY_EXACT
// Returns whether a fragment is behind the layer before, and not behind an opaque surface.
bool is_next(uvec2 number)
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    float depth = gl_FragCoord.z;
    float before = texelFetch(u_peeled_depth, texel, 0).r;
    uvec2 last = texelFetch(u_peeled_number, texel, 0).xy;
    bool later = number.x > last.x || (number.x == last.x && number.y > last.y);
#if REVERSE
    bool behind = depth < before || (depth == before && later);
#else
    bool behind = depth > before || (depth == before && later);
#endif
#if SURFACES
    float opaque = texelFetch(u_depth, texel, 0).r;
#if REVERSE
    return behind && depth >= opaque;
#else
    return behind && depth <= opaque + u_depth_step;
#endif
#else
    return behind;
#endif
}
#endif

void main()
{
    Sample made = sample_material();
#if TRANSPARENCY == TRANSPARENCY_EXACT
    uvec2 number = uvec2(v_instance, uint(gl_PrimitiveID));
    if (!is_next(number))
        discard;
#endif
    vec3 view = surface_view();
    Surface s;
    s.pixel = gl_FragCoord.xy;
    s.ray = (ndc_from_pixel(s.pixel) - u_film.xy) * u_film.zw;
    s.y = view.y;
    s.normal = surface_normal(view, made);
    s.albedo = made.albedo;
#if SPECULAR && !defined(METALLIC)
    s.specular = v_specular;
#else
    s.specular = vec4(0.0);
#endif
#ifdef METALLIC
    s.metallic = vec2(made.metallic, made.roughness);
#endif
    vec3 sum = made.ambient * u_ambient.rgb;
#each_light_set     sum += light_of_set_@(s);
#ifdef PYRENDER
    sum *= made.tint;
#endif
#if EMISSION
    sum += made.emission;
#endif
    float alpha = clamp(made.alpha, 0.0, 1.0);
#ifdef PYRENDER
    vec3 value = power_encoded(sum * u_exposure.rgb);  // display values are mixed
#elif defined(PANDA3D)
    vec3 value = min(sum, 1.0) * made.tint;
#ifdef GLOSS
    value += gloss_sum;
#endif
    value = min(value, 1.0);
#else
    vec3 value = min(sum, LARGEST_LIGHT);
#endif
    vec4 shown = vec4(value * alpha, alpha);
#if TRANSPARENCY == TRANSPARENCY_SORTED
    o_transparency = shown;
#elif TRANSPARENCY == TRANSPARENCY_WEIGHTED
    float weight = weight_at(view.y);
    o_transparency = vec4(shown.rgb * weight, alpha);
    o_transparency_weight = alpha * weight;
#else
    o_layer = shown;
    o_layer_place = vec2(view.y, 1.0);
    o_layer_number = number;
#endif
}
