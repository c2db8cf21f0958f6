#version 330 core
// What one slice has is added to the next.
uniform sampler2D u_volume_sum;
uniform ivec2 u_corner;
out vec4 o_volume_atlas;

void main()
{
    o_volume_atlas = vec4(texelFetch(u_volume_sum, ivec2(gl_FragCoord.xy) - u_corner, 0).rgb, 0.0);
}
