#version 330 core
// Copies the depth of every second pixel in each direction: the depth buffer for light volumes at half resolution.

uniform sampler2D u_depth;

void main()
{
    gl_FragDepth = texelFetch(u_depth, 2 * ivec2(gl_FragCoord.xy), 0).r;
}
