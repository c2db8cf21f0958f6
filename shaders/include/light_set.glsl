// Provides light_of_set: the radiance that the lights of one set add to a surface. It is included once for each set, after
// phong.glsl, rests.glsl, cone.glsl, shine.glsl, sums.glsl and, where a set needs them, shadow.glsl, particle_shadow.glsl.
#include "include/arrives.glsl"
#include "include/light_surface.glsl"
#if LIGHT_METHOD == LIGHT_METHOD_CLUSTERED
#include "include/clusters.glsl"
#endif

vec3 light_of_set(Surface s)
{
    radiance_sum = radiance_carried = radiance_all = vec3(0.0);
#if LIGHT_METHOD == LIGHT_METHOD_CLUSTERED
#include "include/walk_cell.glsl"
#else
    for (int i = 0; i < u_light_count; ++i)
        light_surface(s, fetch_light(i));
#endif
    return radiance_sum;
}
