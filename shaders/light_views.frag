#version 330 core
// The light volumes themselves. LIGHT_VIEW_OVERDRAW: how often a pixel is shaded. LIGHT_VIEW_VOLUMES: flat colours that
// add up. LIGHT_VIEW_WIREFRAME: lines.
// LIGHT_METHOD_CLUSTERED: how many lights a pixel's cell holds.
#if LIGHT_METHOD == LIGHT_METHOD_CLUSTERED
#define PLACED 1
#define RADIANCE 0
#define SPECULAR_MODEL SPECULAR_MODEL_NONE
#define LIGHT_RESOLUTION LIGHT_RESOLUTION_FULL
#define NORMAL_FORMAT NORMAL_FORMAT_OCT16
#define ALBEDO_FORMAT ALBEDO_FORMAT_LINEAR
#include "include/surface.glsl"
#include "include/clusters.glsl"
#else
flat in vec4 v_color;
#endif

#if LIGHT_VIEW == LIGHT_VIEW_OVERDRAW
out float o_overdraw;
#elif LIGHT_VIEW == LIGHT_VIEW_VOLUMES
out vec4 o_volumes;
#else
out vec4 o_wireframe;
#endif

// faint enough to distinguish several volumes, or lines, over each other
const float FAINT = 0.12;
const float LINE = 0.3;

#if LIGHT_METHOD == LIGHT_METHOD_CLUSTERED

void main()
{
    Cell cell = find_cell(read_place(ivec2(gl_FragCoord.xy)));
    o_overdraw = 0.0;
    for (int word = cell.word; word < cell.end; word += 4)
        for (uvec4 bits = masks_at(cell, word); bits != uvec4(0u); bits &= bits - min(bits, 1u))
            o_overdraw += dot(vec4(min(bits, 1u)), vec4(1.0));
}

#else

void main()
{
    vec3 hue = v_color.rgb / max(max(v_color.r, v_color.g), max(v_color.b, 1e-30));
#if LIGHT_VIEW == LIGHT_VIEW_OVERDRAW
    o_overdraw = 1.0;
#elif LIGHT_VIEW == LIGHT_VIEW_VOLUMES
    o_volumes = vec4(hue * FAINT, 1.0);
#else
    o_wireframe = vec4(hue * LINE, 1.0);
#endif
}

#endif
