#version 330 core
// Blurs slices vertically.
#include "include/particle_shadow_blur.glsl"

uniform sampler2D u_particle_shadow_scratch;
out vec4 o_particle_shadow_atlas;

void main()
{
    o_particle_shadow_atlas = vec4(blurred(u_particle_shadow_scratch, ivec2(0, 1)), 0.0);
}
