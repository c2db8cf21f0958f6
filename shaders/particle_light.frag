#version 330 core
// Lights each particle once, at its centre, by all lights of one kind: one texel per particle. Particles scatter light
// equally in all directions.
// FIRST: adds ambient light as well. ATTENUATED: multiplies by the attenuation that is stored with each particle.
#define PLACED 1
#define LIGHT_METHOD LIGHT_METHOD_LOOP
#define POSITION_SOURCE POSITION_SOURCE_STORED
#define LIGHT_RESOLUTION LIGHT_RESOLUTION_FULL
#define RADIANCE 0
#define SPECULAR_MODEL SPECULAR_MODEL_NONE
#define NORMAL_FORMAT NORMAL_FORMAT_OCT16
#define ALBEDO_FORMAT ALBEDO_FORMAT_LINEAR
#include "include/surface.glsl"
#if LIGHT_KIND != LIGHT_KIND_NONE
#include "include/arrives.glsl"
#endif
#if SHADOW_TAPS
#include "include/shadow.glsl"
#endif
#if PARTICLE_SHADOW
#include "include/particle_shadow.glsl"
#endif
#block Shading

uniform sampler2D u_particles;  // four texels per particle: firefly_sample/gpu/instance_rows.py
out vec4 o_particle_light;

void main()
{
    ivec2 at = ivec2(gl_FragCoord.xy) * ivec2(4, 1);
    vec4 place = texelFetch(u_particles, at, 0);
    vec4 color = texelFetch(u_particles, at + ivec2(1, 0), 0);
    vec3 sum = vec3(0.0);
#if LIGHT_KIND != LIGHT_KIND_NONE
    Surface s;
    s.pixel = vec2(0.0);
    s.ray = vec2(0.0);
    s.y = place.y;
    s.place = place.xyz;
    s.albedo = vec3(0.0);
    s.specular = vec4(0.0);
    for (int i = 0; i < u_light_count; ++i) {
        Light light = fetch_light(i);
        vec3 to_light;
        float strength;
        if (arrives(s, light, to_light, strength)) {
#if SHADOW_TAPS
            s.normal = to_light;
            strength *= shadow(s, to_light, 1.0, light.shadow);
#endif
            sum += min(strength * light.color.rgb, 1e30);  // infinity times a colour of 0 would be NaN
        }
    }
#if ATTENUATED
    sum *= place.w;
#endif
#if PARTICLE_SHADOW
    if (color.w > 0.0) {  // the particle receives shadows
        vec3 shadowed = texelFetch(u_particles, at + ivec2(2, 0), 0).xyz;
        vec3 own = texelFetch(u_particles, at + ivec2(3, 0), 0).rgb;
        sum *= volume_light(shadowed, own);
    }
#endif
#endif
#if FIRST
    sum += u_ambient.rgb;
#endif
    o_particle_light = vec4(sum * color.rgb, 0.0);
}
