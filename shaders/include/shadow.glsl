// Provides shadow: the share of a light that reaches a surface, from the atlas of shadow maps.
// SHADOW_TAPS 1: compares the nearest texel. 4: 2x2 texels, weighted. 16: 4x4 texels, weighted.
// Each comparison is made at the centre of a texel, with the depth that the surface's plane has there, so that a wide
// filter needs no more bias than a narrow one: Isidoro, "Shadow Mapping: GPU-based Tips and Techniques", GDC 2006.
// The plane is used only where it comes nearer to the light. Where it recedes, the surface may not, as in a corner.
// Float64 twin: firefly_sample/lab/reference/shadow.py

uniform sampler2DShadow u_shadow_atlas;
uniform sampler2D u_shadow_maps;  // five texels per map: firefly_sample/gpu/light_records.py

const float NORMAL_OFFSET = 0.25;  // texels along the normal, at grazing angles
const float LIFT = 0.05;          // texels towards the light, at any angle
const float ROUNDING = 1e-6;      // relative rounding error of distances in float32

// Returns the cube map face of a direction from the light: +x, -x, +y, -y, +z, -z of the world.
int cube_face(vec3 way)
{
    vec3 d = vec3(dot(way, u_east.xyz), dot(way, u_north.xyz), dot(way, u_up.xyz));
    vec3 a = abs(d);
    if (a.x >= a.y && a.x >= a.z)
        return d.x >= 0.0 ? 0 : 1;
    if (a.y >= a.z)
        return d.y >= 0.0 ? 2 : 3;
    return d.z >= 0.0 ? 4 : 5;
}

// slope: change of the depth per texel. nearer: sign of a change of depth towards the light.
float lit_texel(vec2 texel, vec4 tile, vec2 from, float depth, vec2 slope, float nearer)
{
    vec2 inside = clamp(texel, 0.0, tile.z - 1.0) + 0.5;
    float here = depth + nearer * max(nearer * dot(slope, inside - from), 0.0);
    return texture(u_shadow_atlas, vec3((tile.xy + inside) / vec2(textureSize(u_shadow_atlas, 0)), here));
}

// entry: the index of the light's first map, and the number of its maps
float shadow(Surface s, vec3 to_light, float n_dot_l, vec4 entry)
{
    int map = int(entry.x) + (entry.y > 1.5 ? cube_face(-to_light) : 0);
    vec4 x_row = texelFetch(u_shadow_maps, ivec2(0, map), 0);
    vec4 y_row = texelFetch(u_shadow_maps, ivec2(1, map), 0);
    vec4 z_row = texelFetch(u_shadow_maps, ivec2(2, map), 0);
    vec4 scale = texelFetch(u_shadow_maps, ivec2(3, map), 0);  // texels per slope, or per unit; y_fold, w_fold
    vec4 tile = texelFetch(u_shadow_maps, ivec2(4, map), 0);   // corner, side, 1 for perspective

    vec4 place = vec4(place_of(s), 1.0);
    vec3 q = vec3(dot(x_row, place), dot(y_row, place), dot(z_row, place));
    vec3 n = vec3(dot(x_row.xyz, s.normal), dot(y_row.xyz, s.normal), dot(z_row.xyz, s.normal));
    bool perspective = tile.w > 0.5;
    float nearer = (scale.z > 0.0) == perspective ? 1.0 : -1.0;
    if (perspective && q.y <= 0.0)
        return 1.0;  // behind a spotlight
    float texel = (perspective ? q.y : 1.0) / min(scale.x, scale.y);
    float grazing = sqrt(max(1.0 - n_dot_l * n_dot_l, 0.0));
    q += n * (NORMAL_OFFSET * texel * grazing);

    vec2 from;  // texels from the tile's corner: from the atlas's corner, float32 would round the filter's weights
    float depth;
    vec2 slope;  // change of the depth along the surface's plane, per texel
    float lift = LIFT * texel + ROUNDING * (abs(s.y) + abs(q.y));
    if (perspective) {
        float side = dot(n, q);  // 0 if the light lies in the surface's plane
        side = -max(-side, 1e-3 * length(q));
        from = q.xz / q.y * scale.xy;
        depth = scale.z / max(q.y - lift, 1e-6 * q.y) - scale.w;
        slope = scale.z * n.xz / side / scale.xy;
    } else {
        float side = min(n.y, -1e-3);
        from = q.xz * scale.xy;
        depth = (q.y - lift) / scale.z - scale.w;
        slope = -n.xz / side / scale.z / scale.xy;
    }
#if defined(PYRENDER) || defined(PANDA3D)
    if (n_dot_l <= 0.0)
        slope = vec2(0.0);  // what faces away from the light stays behind what faces it
#endif
    from += 0.5 * tile.z;
    if (any(lessThan(from, vec2(0.0))) || any(greaterThan(from, vec2(tile.z))))
        return 1.0;  // beyond a sun's shadow distance

#if SHADOW_TAPS == 1
    return lit_texel(floor(from), tile, from, depth, slope, nearer);
#else
    vec2 first = floor(from - 0.5);
    vec2 f = from - 0.5 - first;
    float sum = 0.0;
#if SHADOW_TAPS == 4
    for (int j = 0; j < 2; ++j)
        for (int i = 0; i < 2; ++i) {
            vec2 weight = vec2(i == 0 ? 1.0 - f.x : f.x, j == 0 ? 1.0 - f.y : f.y);
            sum += weight.x * weight.y * lit_texel(first + vec2(i, j), tile, from, depth, slope, nearer);
        }
    return sum;
#else
    for (int j = -1; j < 3; ++j)
        for (int i = -1; i < 3; ++i) {
            vec2 weight = vec2(i == -1 ? 1.0 - f.x : i == 2 ? f.x : 1.0, j == -1 ? 1.0 - f.y : j == 2 ? f.y : 1.0);
            sum += weight.x * weight.y * lit_texel(first + vec2(i, j), tile, from, depth, slope, nearer);
        }
    return sum / 9.0;
#endif
#endif
}
