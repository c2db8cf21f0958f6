#version 330 core
// The depth of every second pixel across and down, which light at half resolution tests its volumes against.

uniform sampler2D u_depth;

void main()
{
    gl_FragDepth = texelFetch(u_depth, 2 * ivec2(gl_FragCoord.xy), 0).r;
}
