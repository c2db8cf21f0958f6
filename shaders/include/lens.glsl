// Provides view_to_clip, ndc_from_pixel, view_from_distance, distance_from_depth, view_from_inverse.
// View space: X right, Y forward, Z up. The lens is given by its constants A, B, C, D (docs/unprojection.md).
// Float64 twin: firefly_sample/scene/lens_constants.py
#block View

vec4 view_to_clip(vec3 p)
{
#if ORTHOGRAPHIC
    float w = 1.0;
#else
    float w = p.y;
#endif
    return vec4(u_projection.x * p.x + u_film.x * w,
                u_projection.z * p.z + u_film.y * w,
                u_projection.y * p.y + u_projection.w,
                w);
}

// The difference is exact and only the division is rounded: the error is 3e-8, that of pixel * 2 / size - 1 is 6e-8.
vec2 ndc_from_pixel(vec2 pixel)
{
    return (pixel - u_size.zw) / u_size.zw;
}

vec3 view_from_distance(vec2 ndc, float y)
{
#if ORTHOGRAPHIC
    float w = 1.0;
#else
    float w = y;
#endif
    vec2 xz = (ndc - u_film.xy) * u_film.zw * w;
    return vec3(xz.x, y, xz.y);
}

float distance_from_depth(float depth)
{
#if ORTHOGRAPHIC
    return u_unprojection.x * (depth + u_unprojection.y);
#else
    return u_unprojection.x / (depth + u_unprojection.y);
#endif
}

// Transforms to the world by the inverse of the view-projection matrix, and from there to view space, all in float32:
// the method of many tutorials, kept for comparison. The clip range is OpenGL's -1..1.
vec3 view_from_inverse(vec2 ndc, float depth)
{
    vec4 world = ndc.x * u_inverse_x + ndc.y * u_inverse_y + (2.0 * depth - 1.0) * u_inverse_z + u_inverse_w;
    world.xyz /= world.w;
    return world.x * u_east.xyz + world.y * u_north.xyz + world.z * u_up.xyz + u_origin.xyz;
}
