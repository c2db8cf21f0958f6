#version 330 core
// Forward shading, for comparison with deferred shading: shades surfaces when they are drawn, even those that are
// hidden later, by all lights of one kind.
// FIRST: the first kind of lights writes ambient light and emission as well; the other kinds are added to it.
#define PLACED 1
#define ID 0
#define VISIBILITY 0
#define INTERPOLATION INTERPOLATION_RASTERIZER
#define LIGHT_METHOD LIGHT_METHOD_LOOP
#define POSITION_SOURCE POSITION_SOURCE_STORED
#define LIGHT_RESOLUTION LIGHT_RESOLUTION_FULL
#define RADIANCE 1
#define NORMAL_FORMAT NORMAL_FORMAT_OCT16
#define ALBEDO_FORMAT ALBEDO_FORMAT_LINEAR
#ifdef METALLIC
#define METALLIC_ROUGHNESS 1
#endif
#include "include/surface.glsl"
#include "include/material.glsl"
#if LIGHT_KIND != LIGHT_KIND_NONE
#include "include/arrives.glsl"
#include "include/light_surface.glsl"
#endif
#block Shading

out vec4 o_radiance;
out vec4 o_coverage;
#ifdef TINT
out vec4 o_tint;
#endif
#ifdef GLOSS
out vec4 o_gloss;
#endif

void main()
{
    Sample made = sample_material();
    vec3 view = surface_view();
    Surface s;
    s.pixel = gl_FragCoord.xy;
    s.y = view.y;
    s.ray = view.xz / view.y;
    s.place = view;
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
    vec3 sum = vec3(0.0);
#if LIGHT_KIND != LIGHT_KIND_NONE
    for (int i = 0; i < u_light_count; ++i)
        light_surface(s, fetch_light(i));
    sum = radiance_sum;
#endif
#if FIRST
    sum += made.ambient * u_ambient.rgb;
#endif
#ifdef PYRENDER
    sum *= made.tint;
#endif
#if FIRST
#if EMISSION
    sum += made.emission;
#endif
#endif
    o_radiance = vec4(sum, 0.0);
    o_coverage = vec4(1.0);
#ifdef TINT
#if FIRST
    o_tint = vec4(min(made.tint, LARGEST_HALF), 1.0);
#else
    o_tint = vec4(0.0);
#endif
#endif
#if defined(GLOSS) && LIGHT_KIND != LIGHT_KIND_NONE
    o_gloss = vec4(gloss_sum, 0.0);
#elif defined(GLOSS)
    o_gloss = vec4(0.0);
#endif
}
