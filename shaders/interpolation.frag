#version 330 core
#extension GL_ARB_gpu_shader_fp64 : require
// Recomputes normals and distances in float64 at the pixels that the geometry pass marked as steep. They are
// interpolated between the corners of the triangle whose index it wrote, as in a visibility buffer (Burns, Hunt, JCGT
// 2(2), 2013). A rasterizer interpolates by planes with float32 coefficients; the steeper the plane, the larger its
// rounding error.
// Float64 twin: firefly_sample/lab/reference/surfaces.py
#define ALBEDO_FORMAT ALBEDO_FORMAT_LINEAR
#include "include/lens.glsl"
#include "include/gbuffer.glsl"
#include "include/steep.glsl"
#include "include/unit_normal.glsl"

uniform usampler2D u_visibility;

// firefly_sample/gpu/corner_tables.py
const int TABLE_WIDTH = 4096;
const int INSTANCE_TEXELS = 12;
uniform usampler2D u_triangles;  // one texel per triangle: the indices of its vertices
uniform sampler2D u_vertices;    // three texels per vertex: position, its rounding rest, normal
uniform sampler2D u_instances;

const float FARTHEST_OUT = 1.0 / 16.0;  // firefly_sample/lab/reference/rays.py

#if NORMAL
out vec4 o_normal;
#endif
#if DISTANCE
out float o_distance;
#endif
#if POSITION_TARGET != POSITION_TARGET_NONE
out vec4 o_position;
#endif

ivec2 texel_of(int index)
{
    return ivec2(index & (TABLE_WIDTH - 1), index / TABLE_WIDTH);
}

vec4 fetch(sampler2D table, int index)
{
    return texelFetch(table, texel_of(index), 0);
}

dvec4 fetch_with_rest(sampler2D table, int index)
{
    return dvec4(fetch(table, index)) + dvec4(fetch(table, index + 1));
}

// Returns the barycentric coordinates of the point on the triangle's edges that is nearest to the pixel's ray.
vec3 nearest(vec3 x, vec3 z)
{
    vec3 shares = vec3(0.0);
    float least = 3e38;
    for (int i = 0; i < 3; ++i) {
        int next = (i + 1) % 3;
        vec2 corner = vec2(x[i], z[i]);
        vec2 edge = vec2(x[next], z[next]) - corner;
        float square = dot(edge, edge);
        float t = square > 0.0 ? clamp(-dot(corner, edge) / square, 0.0, 1.0) : 0.0;
        vec2 beside = corner + t * edge;
        if (dot(beside, beside) < least) {
            least = dot(beside, beside);
            shares = vec3(0.0);
            shares[i] = 1.0 - t;
            shares[next] = t;
        }
    }
    return shares;
}

void main()
{
    uvec2 seen = texelFetch(u_visibility, ivec2(gl_FragCoord.xy), 0).xy;
    if ((seen.y & STEEP_BIT) == 0u)
        discard;
    int row = INSTANCE_TEXELS * int(seen.x - 1u);
    vec4 of_batch = fetch(u_instances, row + 11);
    int triangle = int(of_batch.x) * TABLE_WIDTH + int(of_batch.y) + int(seen.y & ~STEEP_BIT);

    // dot(p, across) and dot(p, up): the offset of p from the pixel's ray, in pixels, times dot(p, ahead)
    dvec4 ahead = fetch_with_rest(u_instances, row + 4);
    dvec4 across = fetch_with_rest(u_instances, row) - double(gl_FragCoord.x) * ahead;
    dvec4 up = fetch_with_rest(u_instances, row + 2) - double(gl_FragCoord.y) * ahead;
    uvec3 corners = texelFetch(u_triangles, texel_of(triangle), 0).xyz;
    dvec4 y_of = fetch_with_rest(u_instances, row + 6);
    vec3 normals[3];
    dvec3 x, y, z;
    for (int i = 0; i < 3; ++i) {
        int vertex = 3 * int(corners[i]);
        dvec4 place = dvec4(fetch_with_rest(u_vertices, vertex).xyz, 1.0);
        normals[i] = fetch(u_vertices, vertex + 2).xyz;
        x[i] = dot(place, across);
        y[i] = dot(place, y_of);
        z[i] = dot(place, up);
    }
    // a corner's barycentric coordinate is proportional to the area of the ray and the opposite edge
    dvec3 areas = x.yzx * z.zxy - z.yzx * x.zxy;
    double whole = areas.x + areas.y + areas.z;
    dvec3 shares = areas / (whole != 0.0 ? whole : 1.0);
    // The rasterizer snaps corners to a grid, so a triangle may cover pixels outside it. Extrapolating a thin triangle
    // to them would give arbitrary values; the nearest point on its edges is used instead.
    if (whole == 0.0 || min(min(shares.x, shares.y), shares.z) < -FARTHEST_OUT)
        shares = dvec3(nearest(vec3(x), vec3(z)));

    vec3 view = view_from_distance(ndc_from_pixel(gl_FragCoord.xy), float(dot(y, shares)));
#if NORMAL
    vec3 s = vec3(shares);
    vec3 n = normals[0] * s.x + normals[1] * s.y + normals[2] * s.z;
    vec3 normal = vec3(dot(n, fetch(u_instances, row + 8).xyz),
                       dot(n, fetch(u_instances, row + 9).xyz),
                       dot(n, fetch(u_instances, row + 10).xyz));
    o_normal = encode_normal(unit_normal(normal, view, of_batch.z != 0.0));
#endif
#if DISTANCE
    o_distance = view.y;
#endif
#if POSITION_TARGET == POSITION_TARGET_FLOAT32
    o_position = vec4(view, 1.0);
#elif POSITION_TARGET == POSITION_TARGET_FLOAT16
    o_position = vec4(clamp(view, -65504.0, 65504.0), 1.0);  // the largest half float
#endif
}
