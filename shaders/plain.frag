#version 330 core
// Soft round dots, added to the radiance: (1 - r^2)^2.

in vec2 v_corner;
flat in vec3 v_color;
out vec4 o_radiance;

void main()
{
    float s = max(1.0 - dot(v_corner, v_corner), 0.0);
    o_radiance = vec4(v_color * (s * s), 0.0);
}
