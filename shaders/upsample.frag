#version 330 core
// Spreads light of every second pixel to all. A pixel takes it from up to four neighbours, by their weight in bilinear
// interpolation, and by how near they lie to the plane of its own surface. After Kopf et al., "Joint Bilateral
// Upsampling", SIGGRAPH 2007. A pixel that was lit itself keeps what it has. Comparing normals as well would take a
// fifth off the error, and double the cost.
#define PLACED 1
#define LIGHT_RESOLUTION LIGHT_RESOLUTION_FULL
#define SPECULAR_MODEL SPECULAR_MODEL_NONE
#include "include/surface.glsl"

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

const float WIDTH = 2.0;   // pixels at the surface's distance, by which a neighbour may be off its plane
const float LEAST = 1e-4;  // of a neighbour that fits not at all, so that one that fits best always counts

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
    o_radiance = vec4((s.albedo * light + shine) * scale, 0.0);
#endif
#if LIGHT
    o_light = vec4(light * scale, 0.0);
#endif
}
