#version 330 core
// Draws a square around each particle, in the tile of its slice.
#include "include/particle_shadow_tiles.glsl"

in vec2 in_corner;
in vec4 in_disc;      // texels across and up in the tile, slice, radius in texels
in vec3 in_strength;
flat out vec4 v_disc;
flat out vec2 v_corner;
flat out vec3 v_strength;

void main()
{
    v_disc = in_disc;
    v_strength = in_strength;
    v_corner = vec2(tile_corner(int(in_disc.z)));
    // clipped to the tile: no particle may draw into a neighbouring tile
    vec2 at = clamp(in_disc.xy + in_disc.w * in_corner, vec2(0.0), vec2(u_particle_shadow_tiles.x));
    float rows = ceil(u_particle_shadow_tiles.z / u_particle_shadow_tiles.y);
    vec2 size = u_particle_shadow_tiles.x * vec2(u_particle_shadow_tiles.y, rows);
    gl_Position = vec4((v_corner + at) / size * 2.0 - 1.0, 0.0, 1.0);
}
