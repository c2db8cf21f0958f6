// Provides fullscreen_corner, on_sphere, on_cone: the clip position of a vertex of a light's proxy.
// LIGHT_METHOD_SPHERE: a sphere, circumscribed so that its flat faces miss nothing. LIGHT_METHOD_CONE: a cone with its tip
// at the origin and its base at y = 1, circumscribed likewise. LIGHT_METHOD_FULLSCREEN: one full-screen triangle for each
// light. LIGHT_METHOD_LOOP, LIGHT_METHOD_CLUSTERED: one for all lights.
// LIGHT_RESOLUTION_HALF: the target holds every second pixel; a fragment's centre lies where its pixel's does.
#include "include/lens.glsl"
#ifndef LIGHT_RESOLUTION
#define LIGHT_RESOLUTION LIGHT_RESOLUTION_FULL  // the views of the proxies are always drawn at full resolution
#endif

vec4 fullscreen_corner()
{
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    return vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}

vec4 onto_target(vec4 clip)
{
#if LIGHT_RESOLUTION == LIGHT_RESOLUTION_HALF
    // pixel x becomes x/2 + 1/4, on a target of half the size, rounded up
    vec2 half_size = floor(0.5 * u_size.xy + 0.5);
    clip.xy = clip.xy * (0.5 * u_size.xy / half_size) + clip.w * ((0.5 * u_size.xy + 0.5) / half_size - 1.0);
#endif
    return clip;
}

vec4 on_sphere(vec4 place, vec3 vertex)
{
    return onto_target(view_to_clip(place.xyz + place.w * vertex));
}

const float MARGIN = 1e-4;  // share of the height by which tip and base are moved outwards, against rounding

vec4 on_cone(vec3 tip, vec3 axis, float height, float tangent, vec3 vertex)
{
    // v, axis and u form a right-handed basis: Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017
    float s = axis.z >= 0.0 ? 1.0 : -1.0;
    float a = -1.0 / (s + axis.z);
    float b = axis.x * axis.y * a;
    vec3 u = vec3(1.0 + s * axis.x * axis.x * a, s * b, -s * axis.x);
    vec3 v = vec3(b, s + axis.y * axis.y * a, -axis.y);
    vec3 along = axis * (vertex.y * (1.0 + 2.0 * MARGIN) - MARGIN);
    return onto_target(view_to_clip(tip + height * (along + tangent * (v * vertex.x + u * vertex.z))));
}
