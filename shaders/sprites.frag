#version 330 core
// Soft round dots, added to the radiance: (1 - r^2)^2. A pixel's own place is exact, so that the difference to the
// centre is, too; a rasterizer would hand it down rounded as the picture's width is.

flat in vec4 v_pixel;
flat in vec2 v_per_radius;
flat in vec3 v_color;
out vec4 o_radiance;

void main()
{
    vec2 r = ((gl_FragCoord.xy - v_pixel.xy) - v_pixel.zw) * v_per_radius;
    float s = max(1.0 - dot(r, r), 0.0);
    o_radiance = vec4(v_color * (s * s), 0.0);
}
