#version 330 core
// Blurs slices across.
#include "include/volume_blur.glsl"

uniform sampler2D u_volume_atlas;
out vec4 o_volume_scratch;

void main()
{
    o_volume_scratch = vec4(blurred(u_volume_atlas, ivec2(1, 0)), 0.0);
}
