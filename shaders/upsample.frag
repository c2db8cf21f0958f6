#version 330 core
// Upsamples light that was computed at every second pixel in each direction (Kopf et al., "Joint Bilateral Upsampling",
// SIGGRAPH 2007). A pixel averages up to four neighbours, with bilinear weights and weights for their distance from the
// plane of its own surface. A pixel that was lit itself keeps its value. Comparing normals as well would reduce the
// error by a fifth, and double the cost.
#define PLACED 1
#define LIGHT_RESOLUTION LIGHT_RESOLUTION_FULL
#define SPECULAR_MODEL SPECULAR_MODEL_NONE
#include "include/surface.glsl"
#ifdef METALLIC_ROUGHNESS
#include "include/metallic.glsl"
#endif

uniform sampler2D u_half_light;
#if SHINE
uniform sampler2D u_half_shine;
#endif
#if RADIANCE
out vec4 o_radiance;
#endif
#if LIGHT
out vec4 o_light;
#endif

const float WIDTH = 2.0;   // typical distance of a neighbour from the plane, in pixels at the surface's distance
const float LEAST = 1e-4;  // least weight, so that the best of several distant neighbours still counts

float pixel_at(Surface s)
{
#if ORTHOGRAPHIC
    return u_pixel.x;
#else
    return u_pixel.x * abs(s.y);
#endif
}

void main()
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    Surface s = read_surface(texel);
    vec3 place = place_of(s);
    float width = 1.0 / (WIDTH * pixel_at(s) + 1e-30);
    ivec2 first = texel / 2;
    ivec2 odd = texel - 2 * first;
    ivec2 last = textureSize(u_half_light, 0) - 1;
    vec3 light = vec3(0.0);
    vec3 shine = vec3(0.0);
    float sum = 0.0;
    for (int j = 0; j <= odd.y; ++j)
        for (int i = 0; i <= odd.x; ++i) {
            ivec2 at = first + ivec2(i, j);
            at = min(at, last);
            Surface other = read_surface(2 * at);
            float off = dot(place_of(other) - place, s.normal) * width;
            float off2 = min(off * off, 1e6);  // the weights' sum must not vanish
            float weight = LEAST / (1.0 + off2) + exp(-min(off2, 80.0));
            light += weight * texelFetch(u_half_light, at, 0).rgb;
#if SHINE
            shine += weight * texelFetch(u_half_shine, at, 0).rgb;
#endif
            sum += weight;
        }
    float scale = sum > 0.0 ? 1.0 / sum : 0.0;
#if RADIANCE
#ifdef METALLIC_ROUGHNESS
    if (s.metallic.x >= 0.0)
        s.albedo = diffuse_color(s.albedo, s.metallic.x);
#endif
    o_radiance = vec4((s.albedo * light + shine) * scale, 0.0);
#endif
#if LIGHT
    o_light = vec4(light * scale, 0.0);
#endif
}
