#version 330 core
// Copies a layer of blended surfaces, to be put under those before it.
uniform sampler2D u_layer;
out vec4 o_transparency;

void main()
{
    o_transparency = texelFetch(u_layer, ivec2(gl_FragCoord.xy), 0);
}
