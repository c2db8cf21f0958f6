// Provides Surface, read_place and read_surface: the surface at a pixel, as lights need it; and way_to_light.
// PLACED 0: the position is not needed. POSITION 0: from its distance. POSITION 1: from the depth buffer.
// POSITION 2: from the depth buffer through the inverse of the view-projection matrix. POSITION 3: as stored.
// LIGHT_RESOLUTION_HALF: a fragment stands for every second pixel across and down.
#include "include/lens.glsl"
#include "include/gbuffer.glsl"

uniform sampler2D u_normal;
#if RADIANCE && (LIGHT_RESOLUTION == LIGHT_RESOLUTION_FULL || defined(METALLIC_ROUGHNESS))
#define HAS_ALBEDO 1
#else
#define HAS_ALBEDO 0
#endif
#if HAS_ALBEDO
uniform COLOR_SAMPLER u_albedo;
#endif
#ifdef METALLIC_ROUGHNESS
uniform sampler2D u_metallic_roughness;
#endif
#ifdef TINT
uniform COLOR_SAMPLER u_tint;  // multiplies all light that a surface reflects
#endif
#if SPECULAR_MODEL != SPECULAR_MODEL_NONE
uniform sampler2D u_specular;
#endif
#if PLACED
#if POSITION_SOURCE == POSITION_SOURCE_DISTANCE
uniform sampler2D u_distance;
#elif POSITION_SOURCE == POSITION_SOURCE_STORED
uniform sampler2D u_position;
#else
uniform sampler2D u_depth;
#endif
#endif

#define HAS_PLACE (PLACED && POSITION_SOURCE >= POSITION_SOURCE_INVERSE_MATRIX)

struct Surface {
    vec2 pixel;
    vec2 ray;       // (x, z) of the pixel's ray at y = 1; orthographic: (x, z) of the position
    float y;
#if HAS_PLACE
    vec3 place;     // need not lie exactly on that ray
#endif
    vec3 normal;    // unit
    vec3 albedo;
    vec4 specular;  // colour, shininess
#ifdef LOCAL_VIEWERS
    bool local;     // highlights see the eye where it is
#endif
#ifdef METALLIC_ROUGHNESS
    vec2 metallic;  // metalness, roughness; the first below 0 for other models; else the albedo is the base colour
#endif
};

// Replaces infinity and NaN (from an infinite far plane, the background or an overflow), so that later values are
// numbers.
float finite(float value)
{
    return abs(value) < 1e37 ? value : 1e37;
}

// Reads the position only, without the material.
Surface read_place(ivec2 texel)
{
    Surface s;
    s.pixel = vec2(texel) + 0.5;
    vec2 ndc = ndc_from_pixel(s.pixel);
    s.ray = (ndc - u_film.xy) * u_film.zw;
    s.y = 1.0;
#if PLACED
#if POSITION_SOURCE == POSITION_SOURCE_DISTANCE
    s.y = finite(texelFetch(u_distance, texel, 0).r);
#elif POSITION_SOURCE == POSITION_SOURCE_DEPTH
    s.y = finite(distance_from_depth(texelFetch(u_depth, texel, 0).r));
#else
#if POSITION_SOURCE == POSITION_SOURCE_INVERSE_MATRIX
    vec3 place = view_from_inverse(ndc, texelFetch(u_depth, texel, 0).r);
#else
    vec3 place = texelFetch(u_position, texel, 0).xyz;
#endif
    s.place = vec3(finite(place.x), finite(place.y), finite(place.z));
    s.y = s.place.y;
#endif
#endif
    return s;
}

Surface read_surface(ivec2 texel)
{
    Surface s = read_place(texel);
    s.normal = decode_normal(texelFetch(u_normal, texel, 0));
#if HAS_ALBEDO
    s.albedo = unpack_color(texelFetch(u_albedo, texel, 0));
#else
    s.albedo = vec3(0.0);
#endif
#if SPECULAR_MODEL != SPECULAR_MODEL_NONE
    vec4 stored = texelFetch(u_specular, texel, 0);
#ifdef LOCAL_VIEWERS
    stored.a = decode_viewer(stored.a, s.local);
#endif
    s.specular = decode_specular(stored);
#else
    s.specular = vec4(0.0);
#endif
#ifdef METALLIC_ROUGHNESS
    s.metallic = decode_metallic(texelFetch(u_metallic_roughness, texel, 0).rg);
#endif
    return s;
}

vec3 place_of(Surface s)
{
#if HAS_PLACE
    return s.place;
#elif ORTHOGRAPHIC
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

// Returns the vector from the surface to a light. Subtracting two float32 positions would leave mostly rounding error
// where they are close. So the vector has two parts: from this pixel's ray to the light, at the light's distance, which
// is the difference of their pixel coordinates, both exact, times the width of a pixel there; and along this pixel's
// ray.
vec3 way_to_light(Surface s, vec4 place, vec4 pixel, float rest_of_y)
{
#if HAS_PLACE
    return place.xyz - s.place;
#else
    vec2 apart = (pixel.xy - s.pixel) + pixel.zw;
    float y = (place.y - s.y) + rest_of_y;
#if ORTHOGRAPHIC
    vec2 across = apart * u_pixel.xy;
#else
    float distance = max(place.y, u_pixel.z);  // the distance that pixel is for: firefly_sample/gpu/light_records.py
    vec2 across = apart * (distance * u_pixel.xy) + s.ray * (distance - s.y);
#endif
    return vec3(across.x, y, across.y);
#endif
}
