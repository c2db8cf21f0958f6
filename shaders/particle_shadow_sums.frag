#version 330 core
// Adds the sum up to one slice to the next slice, by blending.
uniform sampler2D u_particle_shadow_sum;
uniform ivec2 u_corner;
out vec4 o_particle_shadow_atlas;

void main()
{
    o_particle_shadow_atlas = vec4(texelFetch(u_particle_shadow_sum, ivec2(gl_FragCoord.xy) - u_corner, 0).rgb, 0.0);
}
