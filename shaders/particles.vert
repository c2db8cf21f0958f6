#version 330 core
// Draws a square that faces the camera around each particle, and around each soft dot among them.
#include "include/lens.glsl"

in vec2 in_corner;
in vec4 in_dot;         // centre in view space, radius
in vec4 in_pixel;       // position of the centre: two float32 (number and rest) each across and up
in vec2 in_per_radius;  // 1 / radius in pixels, across and up
in vec3 in_color;       // of a dot
in vec3 in_particle;    // optical depth through the centre; index, -1 for a dot; distance of the centre
uniform sampler2D u_particle_light;
flat out vec4 v_pixel;
flat out vec2 v_per_radius;
flat out vec3 v_color;
flat out vec2 v_depth;  // distance and radius
flat out float v_optical_depth;  // below 0 for a dot

void main()
{
    v_pixel = in_pixel;
    v_per_radius = in_per_radius;
    v_color = in_color;
    v_optical_depth = -1.0;
    v_depth = vec2(in_particle.z, in_dot.w);
    if (in_particle.y >= 0.0) {
        v_optical_depth = in_particle.x;
        int number = int(in_particle.y);
        int width = textureSize(u_particle_light, 0).x;
        v_color = texelFetch(u_particle_light, ivec2(number % width, number / width), 0).rgb;
    }
    gl_Position = view_to_clip(in_dot.xyz + in_dot.w * vec3(in_corner.x, 0.0, in_corner.y));
}
