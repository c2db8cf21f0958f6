// Provides main of a light's pass, for after the record and after arrives, which says whether a light comes to a
// surface, from where, and how much of it. One light a fragment; METHOD 3: all.
// A pixel out of reach adds 0: discard would cost more.
#include "include/shine.glsl"
#if TAPS
#include "include/shadow.glsl"
#endif

#if RADIANCE
out vec4 o_radiance;
#endif
#if LIGHT
out vec4 o_light;
#endif

void light_surface(Surface s, Light light)
{
    vec3 to_light;
    float strength;
    if (!arrives(s, light, to_light, strength))
        return;
    float n_dot_l = dot(s.normal, to_light);
    if (n_dot_l <= 0.0)
        return;
#if TAPS
    strength *= shadow(s, to_light, n_dot_l, light.shadow);
#endif
#if HIGHLIGHTS
    add_light(s, to_light, n_dot_l, strength, light.color.rgb, light.specular.rgb);
#else
    add_light(s, to_light, n_dot_l, strength, light.color.rgb, vec3(0.0));
#endif
}

void main()
{
    Surface s = read_surface();
#if METHOD == 3
    for (int i = 0; i < u_light_count; ++i)
        light_surface(s, fetch_light(i));
#else
    light_surface(s, receive_light());
#endif
#if RADIANCE
    o_radiance = vec4(radiance_sum, 0.0);
#endif
#if LIGHT
    o_light = vec4(light_sum, 0.0);
#endif
}
