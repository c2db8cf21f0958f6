#version 330 core
// Shades surfaces as they are drawn, seen or not, by all lights of a kind: what deferred shading is measured against.
// FIRST brings ambient light and emission as well; the lights of other kinds are added to it.
#define PLACED 1
#define POSITION 3
#define HALF 0
#define RADIANCE 1
#define NORMALS 0
#define COLORS 0
#include "include/surface.glsl"
#include "include/material.glsl"
#if KIND
#include "include/arrives.glsl"
#include "include/light_surface.glsl"
#endif
#block Shading

out vec4 o_radiance;
out vec4 o_coverage;

void main()
{
    Sample made = sample_material();
    vec3 view = surface_view();
    Surface s;
    s.pixel = gl_FragCoord.xy;
    s.y = view.y;
    s.ray = view.xz / view.y;
    s.place = view;
    s.normal = surface_normal(view);
    s.albedo = made.albedo;
#if SPECULAR
    s.specular = v_specular;
#else
    s.specular = vec4(0.0);
#endif
    vec3 sum = vec3(0.0);
#if KIND
    for (int i = 0; i < u_light_count; ++i)
        light_surface(s, fetch_light(i));
    sum = radiance_sum;
#endif
#if FIRST
    sum += made.ambient * u_ambient.rgb;
#if EMISSION
    sum += v_emission;
#endif
#endif
    o_radiance = vec4(sum, 0.0);
    o_coverage = vec4(1.0);
}
