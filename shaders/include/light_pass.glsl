// Provides main of a light's pass, for a light_surface that comes before: one light a fragment, or METHOD 3: all.
// A pixel out of reach adds 0: discard would cost more.

#if RADIANCE
out vec4 o_radiance;
#endif
#if LIGHT
out vec4 o_light;
#endif

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
