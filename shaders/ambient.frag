#version 330 core
// Writes the first light of each pixel: ambient light and the surface's emission.
// OWN: the reflectance of ambient light is not the albedo; it is read from a target of its own.
// TINT: all reflected light is multiplied by a colour of the surface.
#include "include/gbuffer.glsl"
#block Shading

#if RADIANCE
#if LIT
#if OWN
uniform COLOR_SAMPLER u_ambient_albedo;
#else
uniform COLOR_SAMPLER u_albedo;
#endif
#endif
#ifdef TINT
uniform COLOR_SAMPLER u_tint;
#endif
#if EMISSION
uniform sampler2D u_emission;
#endif
out vec4 o_radiance;
#endif
#if LIGHT
out vec4 o_light;
#endif

void main()
{
#if RADIANCE
    ivec2 texel = ivec2(gl_FragCoord.xy);
    vec3 sum = vec3(0.0);
#if LIT
#if OWN
    sum += unpack_color(texelFetch(u_ambient_albedo, texel, 0)) * u_ambient.rgb;
#else
    sum += unpack_color(texelFetch(u_albedo, texel, 0)) * u_ambient.rgb;
#endif
#endif
#ifdef TINT
    sum *= unpack_color(texelFetch(u_tint, texel, 0));
#endif
#if EMISSION
    sum += texelFetch(u_emission, texel, 0).rgb;
#endif
    o_radiance = vec4(sum, 0.0);
#endif
#if LIGHT
    o_light = vec4(u_ambient.rgb, 0.0);
#endif
}
