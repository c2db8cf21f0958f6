#version 330 core
// Adds a particle to its slice: its strength times (1 - r^2)^2.
flat in vec4 v_disc;
flat in vec2 v_corner;
flat in vec3 v_strength;
out vec4 o_particle_shadow_atlas;

void main()
{
    vec2 r = ((gl_FragCoord.xy - v_corner) - v_disc.xy) / v_disc.w;
    float s = max(1.0 - dot(r, r), 0.0);
    o_particle_shadow_atlas = vec4(v_strength * (s * s), 0.0);
}
