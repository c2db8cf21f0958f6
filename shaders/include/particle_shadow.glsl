// Provides particle_shadow_position, and volume_light: the share of light that particles let through, by colour.
// A position is given in texels across and up in a slice's tile, and its depth in slices.
// Float64 twin: firefly_sample/lab/reference/particles.py
#include "include/particle_shadow_tiles.glsl"

uniform sampler2D u_particle_shadow_atlas;

vec3 particle_shadow_position(vec3 view)
{
    vec4 p = vec4(view, 1.0);
    vec3 q = vec3(dot(u_particle_shadow_x, p), dot(u_particle_shadow_y, p), dot(u_particle_shadow_z, p));
    float w = 1.0;
    if (u_particle_shadow_scale.w > 0.5)
        w = q.y > 0.0 ? q.y : 1e-30;
    float depth = (q.y - u_particle_shadow_scale.y) * u_particle_shadow_scale.z;
    return vec3(q.xz / w * u_particle_shadow_scale.x + 0.5 * u_particle_shadow_tiles.x, depth);
}

// Samples a slice's tile bilinearly.
vec3 volume_texels(int slice, ivec2 first, vec2 part)
{
    ivec2 corner = tile_corner(slice);
    ivec2 last = ivec2(int(u_particle_shadow_tiles.x) - 1);
    ivec2 low = corner + clamp(first, ivec2(0), last);
    ivec2 high = corner + clamp(first + 1, ivec2(0), last);
    vec3 a = texelFetch(u_particle_shadow_atlas, low, 0).rgb;
    vec3 b = texelFetch(u_particle_shadow_atlas, ivec2(high.x, low.y), 0).rgb;
    vec3 c = texelFetch(u_particle_shadow_atlas, ivec2(low.x, high.y), 0).rgb;
    vec3 d = texelFetch(u_particle_shadow_atlas, high, 0).rgb;
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

// own: the particle's own contribution to this lookup, which is subtracted; 0 for surfaces.
vec3 volume_light(vec3 place, vec3 own)
{
    float tile = u_particle_shadow_tiles.x;
    int slices = int(u_particle_shadow_tiles.z);
    // written so that NaN is outside
    bool within = place.z > 0.0 && all(greaterThanEqual(place.xy, vec2(0.0)))
        && all(lessThanEqual(place.xy, vec2(tile)));
    if (!within)
        return vec3(1.0);
    ivec2 first = ivec2(floor(place.xy - 0.5));
    vec2 part = place.xy - 0.5 - vec2(first);
    float depth = min(place.z, float(slices));
    int slice = min(int(depth), slices - 1);

    // if slices are summed, the previous slice holds the sum of all slices up to it
    int reads = int(u_particle_shadow_tiles.w);
    bool summed = reads == 0;
    vec3 before = vec3(0.0);
    for (int k = max(slice - (summed ? 1 : reads), 0); k < slice; ++k)
        before += volume_texels(k, first, part);
    if (u_particle_shadow_sums.y > 0.5 || depth >= float(slices)) {
        vec3 here = volume_texels(slice, first, part);
        if (summed)
            here -= before;
        before += (depth - float(slice)) * max(here - own, 0.0);
    }
    return u_particle_shadow_sums.x > 0.5 ? exp(-before) : max(1.0 - before, 0.0);
}
