// Provides blurred: the mean of a tile's texels in both directions along a step. Texels outside the tile count as 0.
#include "include/particle_shadow_tiles.glsl"

vec3 blurred(sampler2D atlas, ivec2 step)
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    ivec2 within = texel_in_tile(texel);
    float blur = u_particle_shadow_sums.z;
    bool gaussian = u_particle_shadow_sums.w > 0.5;
    int reach = int(ceil(blur));
    int at = within.x * step.x + within.y * step.y;
    int last = int(u_particle_shadow_tiles.x) - 1;
    vec3 sum = vec3(0.0);
    float total = 0.0;
    for (int i = -reach; i <= reach; ++i) {
        float d = abs(float(i));
        float weight = clamp(blur + 1.0 - d, 0.0, 1.0);
        if (gaussian)
            weight = d <= blur ? exp(-2.0 * (d / blur) * (d / blur)) : 0.0;
        total += weight;
        if (at + i >= 0 && at + i <= last)
            sum += weight * texelFetch(atlas, texel + i * step, 0).rgb;
    }
    return sum / total;
}
