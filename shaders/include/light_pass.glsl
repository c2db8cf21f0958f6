// Provides main of a light's pass, for after arrives. A fragment is shaded by one light;
// with LIGHT_METHOD_LOOP by all, with LIGHT_METHOD_CLUSTERED by those of its cell.
// A pixel out of a light's reach adds 0; discard would cost more.
#include "include/light_surface.glsl"
#if LIGHT_METHOD == LIGHT_METHOD_CLUSTERED
#include "include/clusters.glsl"
#include "include/sums.glsl"
#endif

#if RADIANCE
out vec4 o_radiance;
#endif
#ifdef GLOSS
out vec4 o_gloss;
#endif
#if LIGHT
out vec4 o_light;
#endif

void main()
{
#if LIGHT_RESOLUTION == LIGHT_RESOLUTION_HALF
    Surface s = read_surface(2 * ivec2(gl_FragCoord.xy));
#else
    Surface s = read_surface(ivec2(gl_FragCoord.xy));
#endif
#if LIGHT_METHOD == LIGHT_METHOD_LOOP
    for (int i = 0; i < u_light_count; ++i)
        light_surface(s, fetch_light(i));
#elif LIGHT_METHOD == LIGHT_METHOD_CLUSTERED
#include "include/walk_cell.glsl"
#else
    light_surface(s, receive_light());
#endif
#if RADIANCE
#ifdef TINT
    radiance_sum *= unpack_color(texelFetch(u_tint, ivec2(gl_FragCoord.xy), 0));
#endif
    o_radiance = vec4(radiance_sum, 0.0);
#endif
#ifdef GLOSS
    o_gloss = vec4(gloss_sum, 0.0);
#endif
#if LIGHT
    o_light = vec4(light_sum, 0.0);
#endif
}
