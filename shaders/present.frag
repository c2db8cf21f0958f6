#version 330 core
// Copies a picture to the window, pixel by pixel; the viewport is the picture's rectangle.

uniform sampler2D u_picture;
uniform ivec2 u_corner;
out vec4 o_screen;

void main()
{
    o_screen = texelFetch(u_picture, ivec2(gl_FragCoord.xy) - u_corner, 0);
}
