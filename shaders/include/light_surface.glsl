// Provides light_surface, which adds one light to radiance_sum and light_sum. Include it after arrives.glsl.
// PYRENDER: a light also reaches metallic-roughness surfaces that face away from it. PANDA3D: so do highlights.
#include "include/shine.glsl"
#if SHADOW_TAPS
#include "include/shadow.glsl"
#endif
#if PARTICLE_SHADOW
#include "include/particle_shadow.glsl"
#endif

void light_surface(Surface s, Light light)
{
    vec3 to_light;
    float strength;
    if (!arrives(s, light, to_light, strength))
        return;
    float n_dot_l = dot(s.normal, to_light);
#if defined(PYRENDER) && defined(METALLIC_ROUGHNESS) && RADIANCE
    if (n_dot_l <= 0.0 && s.metallic.x < 0.0)
        return;
#elif defined(PANDA3D) && SPECULAR_MODEL != SPECULAR_MODEL_NONE && RADIANCE
    if (n_dot_l <= 0.0 && s.specular.rgb == vec3(0.0))
        return;
#else
    if (n_dot_l <= 0.0)
        return;
#endif
#if SHADOW_TAPS
    strength *= shadow(s, to_light, n_dot_l, light.shadow);
#endif
    STRENGTH arriving = STRENGTH(strength);
#if PARTICLE_SHADOW
    arriving *= volume_light(particle_shadow_position(place_of(s)), vec3(0.0));
#endif
#if SPECULAR_MODEL != SPECULAR_MODEL_NONE
    add_light(s, to_light, n_dot_l, arriving, light.color.rgb, light.specular.rgb);
#else
    add_light(s, to_light, n_dot_l, arriving, light.color.rgb, vec3(0.0));
#endif
}
