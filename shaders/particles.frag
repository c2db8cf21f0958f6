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
out vec4 o_particles;

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
    if (v_optical_depth >= 0.0) {
        float opacity = 1.0 - exp(-v_optical_depth * s * before);
        o_particles = vec4(v_color * opacity, opacity);
    } else {
        o_particles = vec4(v_color * (s * hidden), 0.0);
    }
}
