#version 330 core
// Turns samples into the picture: fills in the background, averages, and applies exposure, tone curve and sRGB.
#include "include/color.glsl"
#if GRADIENT
#include "include/lens.glsl"
#endif
#block Shading

#if RADIANCE
uniform sampler2D u_radiance;
#endif
#if PARTICLES
uniform sampler2D u_particles;
#endif
#if MARKED
uniform sampler2D u_coverage;
#define COVERED texelFetch(u_coverage, texel, 0).r
#elif MASKED
#if PACKED
uniform usampler2D u_albedo;
#define COVERED float(texelFetch(u_albedo, texel, 0).r)
#else
uniform sampler2D u_albedo;
#define COVERED texelFetch(u_albedo, texel, 0).a
#endif
#endif
#if COLOR
out vec4 o_color;
#endif
#if FINAL_RADIANCE
out vec4 o_final_radiance;
#endif

const float LARGEST = 3e38;

vec3 background(vec2 pixel)
{
#if GRADIENT
#if ORTHOGRAPHIC
    vec3 ray = vec3(0.0, 1.0, 0.0);
#else
    vec3 ray = view_from_distance(ndc_from_pixel(pixel), 1.0);
#endif
    float elevation = dot(u_up.xyz, ray) / length(ray);
    return mix(u_horizon.rgb, u_zenith.rgb, sqrt(max(elevation, 0.0)));
#else
    return u_horizon.rgb;
#endif
}

vec3 behind_particles(ivec2 texel)
{
    vec3 value = vec3(0.0);
#if RADIANCE
    value = min(texelFetch(u_radiance, texel, 0).rgb, LARGEST);  // a target of small floats may hold infinity
#endif
#if MASKED
    if (COVERED > 0.0)
        return value;
#endif
#if LOOK == LOOK_CLASSIC
    return value + linear_to_srgb(background(vec2(texel) + 0.5));
#else
    return value + background(vec2(texel) + 0.5);
#endif
}

vec3 sample_radiance(ivec2 texel)
{
    vec3 value = behind_particles(texel);
#if PARTICLES
    vec4 over = texelFetch(u_particles, texel, 0);
    value = value * (1.0 - over.a) + over.rgb;
#endif
    return value;
}

void main()
{
    vec3 sum = vec3(0.0);
    ivec2 first = ivec2(gl_FragCoord.xy) * SUPERSAMPLE;
    for (int y = 0; y < SUPERSAMPLE; ++y)
        for (int x = 0; x < SUPERSAMPLE; ++x)
            sum += sample_radiance(first + ivec2(x, y));
    vec3 value = sum / float(SUPERSAMPLE * SUPERSAMPLE);
#if FINAL_RADIANCE
    o_final_radiance = vec4(value, 1.0);
#endif
#if COLOR
#if LOOK == LOOK_CLASSIC
    o_color = vec4(value, 1.0);  // already display values
#else
    o_color = vec4(linear_to_srgb(tone_curve(value * u_exposure.rgb)), 1.0);
#endif
#endif
}
