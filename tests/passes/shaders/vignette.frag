#version 330 core
// Darkens a picture towards its corners: what is drawn is multiplied with what is there.
#block View

out vec4 o_color;

void main()
{
    vec2 from_middle = 2.0 * float(SUPERSAMPLE) * gl_FragCoord.xy / u_size.xy - 1.0;
    o_color = vec4(vec3(1.0 - STRENGTH * 0.25 * dot(from_middle, from_middle)), 1.0);
}
