// Provides Surface and read_surface: what a light needs to know of the surface behind a pixel; and way_to_light.
// PLACED 0 means that nobody asks where it is.
#include "include/lens.glsl"
#include "include/gbuffer.glsl"

uniform sampler2D u_normal;
#if RADIANCE
uniform sampler2D u_albedo;
#endif
#if HIGHLIGHTS
uniform sampler2D u_specular;
#endif
#if PLACED
#if FROM_DEPTH
uniform sampler2D u_depth_copy;
#else
uniform sampler2D u_distance;
#endif
#endif

struct Surface {
    vec2 ray;       // (x, z) of the way through the pixel at y = 1; orthographic: (x, z) of the place
    float y;
    vec3 normal;    // unit
    vec3 albedo;
    vec4 specular;  // colour, shininess
};

Surface read_surface()
{
    ivec2 texel = ivec2(gl_FragCoord.xy);
    Surface s;
    s.ray = (ndc_from_pixel(gl_FragCoord.xy) - u_film.xy) * u_film.zw;
#if PLACED
#if FROM_DEPTH
    s.y = distance_from_depth(texelFetch(u_depth_copy, texel, 0).r);
#else
    s.y = texelFetch(u_distance, texel, 0).r;
#endif
    if (!(abs(s.y) < 1e37))
        s.y = 1e37;  // an infinite far plane, where nothing is: what follows stays a number
#else
    s.y = 1.0;
#endif
    s.normal = decode_normal(texelFetch(u_normal, texel, 0));
#if RADIANCE
    s.albedo = decode_albedo(texelFetch(u_albedo, texel, 0).rgb);
#else
    s.albedo = vec3(0.0);
#endif
#if HIGHLIGHTS
    s.specular = decode_specular(texelFetch(u_specular, texel, 0));
#else
    s.specular = vec4(0.0);
#endif
    return s;
}

vec3 place_of(Surface s)
{
#if ORTHOGRAPHIC
    return vec3(s.ray.x, s.y, s.ray.y);
#else
    return vec3(s.ray.x * s.y, s.y, s.ray.y * s.y);
#endif
}

// Unit vector to the eye.
vec3 way_to_eye(Surface s)
{
#if ORTHOGRAPHIC
    return vec3(0.0, -1.0, 0.0);
#else
    return -normalize(vec3(s.ray.x, 1.0, s.ray.y));
#endif
}

// From the surface to a light. Across the view, the light's pixel less this one, both exact, times the width of a
// pixel at the light's distance leads to the way through this pixel there; the rest leads along that way. The
// difference of two places would lose what float32 cannot hold of them, all of it where they are near.
vec3 way_to_light(Surface s, vec4 place, vec4 pixel, float rest_of_y)
{
    vec2 apart = (pixel.xy - gl_FragCoord.xy) + pixel.zw;
    float y = (place.y - s.y) + rest_of_y;
#if ORTHOGRAPHIC
    vec2 across = apart * u_pixel.xy;
#else
    float distance = max(place.y, u_pixel.z);  // what pixel was made for: firefly_sample/gpu/light_rows.py
    vec2 across = apart * (distance * u_pixel.xy) + s.ray * (distance - s.y);
#endif
    return vec3(across.x, y, across.y);
}
