#version 330 core
// Light from everywhere: the first light to fill the radiance.
#include "include/gbuffer.glsl"
#block Shading

uniform sampler2D u_albedo;
out vec4 o_radiance;

void main()
{
    vec3 albedo = decode_albedo(texelFetch(u_albedo, ivec2(gl_FragCoord.xy), 0).rgb);
    o_radiance = vec4(albedo * u_ambient.rgb, 0.0);
}
