#version 330 core
// Blurs slices horizontally.
#include "include/particle_shadow_blur.glsl"

uniform sampler2D u_particle_shadow_atlas;
out vec4 o_particle_shadow_scratch;

void main()
{
    o_particle_shadow_scratch = vec4(blurred(u_particle_shadow_atlas, ivec2(1, 0)), 0.0);
}
