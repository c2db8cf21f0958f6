#version 330 core
// Shows the atlas of shadow slices in the picture's lower left corner: white where all light passes, dark where the
// atlas has no slice.
#include "include/particle_shadow_tiles.glsl"
#include "include/color.glsl"

uniform sampler2D u_particle_shadow_atlas;
uniform vec2 u_corner_size;  // pixels
out vec4 o_color;

void main()
{
    vec2 size = vec2(textureSize(u_particle_shadow_atlas, 0));
    ivec2 texel = ivec2(gl_FragCoord.xy / u_corner_size * size);
    vec3 taken = texelFetch(u_particle_shadow_atlas, texel, 0).rgb;
    vec3 left = u_particle_shadow_sums.x > 0.5 ? exp(-taken) : max(1.0 - taken, 0.0);
    ivec2 tile = texel / int(u_particle_shadow_tiles.x);
    if (tile.y * int(u_particle_shadow_tiles.y) + tile.x >= int(u_particle_shadow_tiles.z))
        left = vec3(0.01);
    o_color = vec4(linear_to_srgb(left), 1.0);
}
