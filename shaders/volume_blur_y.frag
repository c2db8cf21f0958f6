#version 330 core
// Blurs slices up and down.
#include "include/volume_blur.glsl"

uniform sampler2D u_volume_scratch;
out vec4 o_volume_atlas;

void main()
{
    o_volume_atlas = vec4(blurred(u_volume_scratch, ivec2(0, 1)), 0.0);
}
