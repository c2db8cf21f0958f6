#version 330 core
// For firefly measure stability: what shaders know of a pixel, its NDC and the way through it at distance 1.
#include "include/lens.glsl"

out vec4 o_result;

void main()
{
    vec2 ndc = ndc_from_pixel(gl_FragCoord.xy);
    o_result = vec4(ndc, view_from_distance(ndc, 1.0).xz);
}
