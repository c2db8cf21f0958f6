#version 330 core
// For firefly measure stability: normals as the geometry pass stores them.
#include "include/gbuffer.glsl"

uniform sampler2D u_normals;

out vec4 o_result;

void main()
{
    o_result = encode_normal(texelFetch(u_normals, ivec2(gl_FragCoord.xy), 0).xyz);
}
