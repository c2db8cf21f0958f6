#version 330 core
// For firefly measure stability: normals as the passes of light read them.
#include "include/gbuffer.glsl"

uniform sampler2D u_stored;

out vec4 o_result;

void main()
{
    o_result = vec4(decode_normal(texelFetch(u_stored, ivec2(gl_FragCoord.xy), 0)), 0.0);
}
