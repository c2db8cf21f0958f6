#version 330 core
// Writes the light of a particle or dot and its opacity, for blending from back to front. A particle is a ball that
// fades out as it sinks into a surface (soft particles); its optical depth has been reduced by the part beyond the near
// and far planes. A dot does not fade: it is either hidden or visible.
#if SURFACES
#include "include/lens.glsl"
#endif

flat in vec4 v_pixel;
flat in vec2 v_per_radius;
flat in vec3 v_color;
flat in vec2 v_depth;
flat in float v_optical_depth;
#ifdef TRANSPARENCY
// among blended surfaces, as shaders/transparent.frag
out vec4 o_transparency;
#define o_particles o_transparency
#if TRANSPARENCY == TRANSPARENCY_WEIGHTED
#include "include/weight.glsl"
out float o_transparency_weight;
#elif TRANSPARENCY == TRANSPARENCY_EXACT
// what lies between two layers
uniform sampler2D u_layer_place;   // distance of the layer behind it, and 1 where there is one
uniform sampler2D u_peeled_place;  // of the layer before it
uniform bool u_first_layer;        // true if there is none before it
#endif
#else
out vec4 o_particles;
#endif

#if SURFACES
#if POSITION_SOURCE == POSITION_SOURCE_DISTANCE
uniform sampler2D u_distance;
#elif POSITION_SOURCE == POSITION_SOURCE_STORED
uniform sampler2D u_position;
#else
uniform sampler2D u_depth;
#endif
#if ORTHOGRAPHIC && (POSITION_SOURCE == POSITION_SOURCE_DISTANCE || POSITION_SOURCE == POSITION_SOURCE_STORED)
#if PACKED
uniform usampler2D u_albedo;
#else
uniform sampler2D u_albedo;
#endif
#endif

float surface_distance(ivec2 texel)
{
#if POSITION_SOURCE == POSITION_SOURCE_DISTANCE
    float y = texelFetch(u_distance, texel, 0).r;
#elif POSITION_SOURCE == POSITION_SOURCE_STORED
    float y = texelFetch(u_position, texel, 0).y;
#else
    float depth = texelFetch(u_depth, texel, 0).r;
    float y = distance_from_depth(depth);
#endif
#if POSITION_SOURCE == POSITION_SOURCE_DISTANCE || POSITION_SOURCE == POSITION_SOURCE_STORED
#if ORTHOGRAPHIC
#if PACKED
    bool covered = texelFetch(u_albedo, texel, 0).r != 0u;
#else
    bool covered = texelFetch(u_albedo, texel, 0).a > 0.0;
#endif
#else
    bool covered = y != 0.0;
#endif
#elif REVERSE
    bool covered = depth > 0.0;
#else
    bool covered = depth < 1.0;
#endif
    return covered ? y : 3e38;
}
#endif

void main()
{
    vec2 r = ((gl_FragCoord.xy - v_pixel.xy) - v_pixel.zw) * v_per_radius;
    float s = max(1.0 - dot(r, r), 0.0);
    s *= s;
    float before = 1.0;
    float hidden = 1.0;
#if SURFACES
    float gap = surface_distance(ivec2(gl_FragCoord.xy)) - v_depth.x;
    before = clamp(0.5 + 0.5 * gap / v_depth.y, 0.0, 1.0);
    hidden = gap >= 0.0 ? 1.0 : 0.0;
#endif
#if defined(TRANSPARENCY) && TRANSPARENCY == TRANSPARENCY_EXACT
    vec2 last = texelFetch(u_layer_place, ivec2(gl_FragCoord.xy), 0).rg;
    vec2 first = texelFetch(u_peeled_place, ivec2(gl_FragCoord.xy), 0).rg;
    float end = (last.g > 0.0 ? last.r : 3e38) - v_depth.x;
    float start = (u_first_layer ? -3e38 : first.g > 0.0 ? first.r : 3e38) - v_depth.x;
    before = min(before, clamp(0.5 + 0.5 * end / v_depth.y, 0.0, 1.0));
    before = max(before - clamp(0.5 + 0.5 * start / v_depth.y, 0.0, 1.0), 0.0);
    hidden *= end >= 0.0 && start < 0.0 ? 1.0 : 0.0;
#endif
    if (v_optical_depth >= 0.0) {
        float opacity = 1.0 - exp(-v_optical_depth * s * before);
        o_particles = vec4(v_color * opacity, opacity);
#if defined(TRANSPARENCY) && TRANSPARENCY == TRANSPARENCY_WEIGHTED
        float weight = weight_at(v_depth.x);
        o_transparency.rgb *= weight;
        o_transparency_weight = opacity * weight;
#endif
    } else {
        o_particles = vec4(v_color * (s * hidden), 0.0);
#if defined(TRANSPARENCY) && TRANSPARENCY == TRANSPARENCY_WEIGHTED
        o_transparency_weight = 0.0;  // dots are drawn elsewhere
#endif
    }
}
