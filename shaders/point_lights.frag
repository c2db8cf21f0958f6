#version 330 core
// Adds point lights to the surfaces that they reach. A pixel out of reach returns 0: discard would cost more.
#include "include/lens.glsl"
#include "include/gbuffer.glsl"
#include "include/falloff.glsl"

uniform sampler2D u_albedo;
uniform sampler2D u_normal;
#if FROM_DEPTH
uniform sampler2D u_depth_copy;
#else
uniform sampler2D u_distance;
#endif

#if METHOD == 2
uniform sampler2D u_lights;  // three texels a light: centre and radius, colour, rest of the centre
uniform int u_light_count;
#else
flat in vec4 v_light;
flat in vec3 v_color;
flat in vec3 v_rest;
#endif

out vec4 o_radiance;

// Irradiance-like factor of one light; multiplied by albedo it is radiance. The difference of two near
// places is exact; the rest that float32 took from the light's comes after it, where it still counts.
vec3 light_surface(vec3 place, vec3 n, vec4 light, vec3 rest, vec3 color)
{
    vec3 to_light = (light.xyz - place) + rest;
    float d2 = dot(to_light, to_light);
    if (d2 >= light.w * light.w)
        return vec3(0.0);
    float d = sqrt(max(d2, 1e-30));  // a light on the surface stays finite
    float n_dot_l = max(dot(n, to_light) / d, 0.0);
    return color * (n_dot_l * falloff(d, light.w));
}

void main()
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
#if FROM_DEPTH
    float y = distance_from_depth(texelFetch(u_depth_copy, texel, 0).r);
#else
    float y = texelFetch(u_distance, texel, 0).r;
#endif
    vec3 place = view_from_distance(ndc_from_pixel(gl_FragCoord.xy), y);
    vec3 n = decode_normal(texelFetch(u_normal, texel, 0));
    vec3 albedo = decode_albedo(texelFetch(u_albedo, texel, 0).rgb);
#if METHOD == 2
    vec3 sum = vec3(0.0);
    int per_row = textureSize(u_lights, 0).x / 3;
    for (int i = 0; i < u_light_count; ++i) {
        ivec2 at = ivec2(3 * (i % per_row), i / per_row);
        vec4 light = texelFetch(u_lights, at, 0);
        vec3 color = texelFetch(u_lights, at + ivec2(1, 0), 0).rgb;
        vec3 rest = texelFetch(u_lights, at + ivec2(2, 0), 0).rgb;
        sum += light_surface(place, n, light, rest, color);
    }
    o_radiance = vec4(albedo * sum, 0.0);
#else
    o_radiance = vec4(albedo * light_surface(place, n, v_light, v_rest, v_color), 0.0);
#endif
}
