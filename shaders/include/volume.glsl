// Provides volume_place, and volume_light: the share of a light that particles leave, by colour.
// A place in the volume is texels across and up in a slice's tile, and the depth in slices.
// Float64 twin: firefly_sample/reference/volume.py
#include "include/volume_tiles.glsl"

uniform sampler2D u_volume_atlas;

vec3 volume_place(vec3 view)
{
    vec4 p = vec4(view, 1.0);
    vec3 q = vec3(dot(u_volume_x, p), dot(u_volume_y, p), dot(u_volume_z, p));
    float w = 1.0;
    if (u_volume_scale.w > 0.5)
        w = q.y > 0.0 ? q.y : 1e-30;
    float depth = (q.y - u_volume_scale.y) * u_volume_scale.z;
    return vec3(q.xz / w * u_volume_scale.x + 0.5 * u_volume_tiles.x, depth);
}

// What a slice's tile holds between texels.
vec3 volume_texels(int slice, ivec2 first, vec2 part)
{
    ivec2 corner = tile_corner(slice);
    ivec2 last = ivec2(int(u_volume_tiles.x) - 1);
    ivec2 low = corner + clamp(first, ivec2(0), last);
    ivec2 high = corner + clamp(first + 1, ivec2(0), last);
    vec3 a = texelFetch(u_volume_atlas, low, 0).rgb;
    vec3 b = texelFetch(u_volume_atlas, ivec2(high.x, low.y), 0).rgb;
    vec3 c = texelFetch(u_volume_atlas, ivec2(low.x, high.y), 0).rgb;
    vec3 d = texelFetch(u_volume_atlas, high, 0).rgb;
    return mix(mix(a, b, part.x), mix(c, d, part.x), part.y);
}

// How much of a disc of this radius in texels the same lookup finds at its own middle.
float own_texels(vec2 part, float radius)
{
    vec2 near = part * part / (radius * radius);
    vec2 far = (1.0 - part) * (1.0 - part) / (radius * radius);
    float a = max(1.0 - near.x - near.y, 0.0);
    float b = max(1.0 - far.x - near.y, 0.0);
    float c = max(1.0 - near.x - far.y, 0.0);
    float d = max(1.0 - far.x - far.y, 0.0);
    return mix(mix(a * a, b * b, part.x), mix(c * c, d * d, part.x), part.y);
}

// own: what a particle has put into its slice itself, 0 for surfaces; radius: that of its disc in texels.
vec3 volume_light(vec3 place, vec3 own, float radius)
{
    float tile = u_volume_tiles.x;
    int slices = int(u_volume_tiles.z);
    // so that what is no number is not within
    bool within = place.z > 0.0 && all(greaterThanEqual(place.xy, vec2(0.0)))
        && all(lessThanEqual(place.xy, vec2(tile)));
    if (!within)
        return vec3(1.0);
    ivec2 first = ivec2(floor(place.xy - 0.5));
    vec2 part = place.xy - 0.5 - vec2(first);
    float depth = min(place.z, float(slices));
    int slice = min(int(depth), slices - 1);

    // sums up to slice k are in slice k - 1, and where nothing is summed, in all before
    int reads = int(u_volume_tiles.w);
    vec3 before = vec3(0.0);
    for (int k = max(slice - reads, 0); k < slice; ++k)
        before += volume_texels(k, first, part);
    if (u_volume_sums.y > 0.5 || depth >= float(slices)) {
        vec3 here = volume_texels(slice, first, part);
        if (reads == 1 && slice > 0)
            here -= before;
        vec3 others = max(here - own * own_texels(part, radius), 0.0);
        before += (depth - float(slice)) * others;
    }
    return u_volume_sums.x > 0.5 ? exp(-before) : max(1.0 - before, 0.0);
}
