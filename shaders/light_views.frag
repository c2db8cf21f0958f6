#version 330 core
// The lights' proxies themselves. VIEW 0: how often a pixel is shaded. VIEW 1: flat colours that add up. VIEW 2: lines.
// METHOD 4: how many lights a pixel's cell holds.
#if METHOD == 4
#define PLACED 1
#define RADIANCE 0
#define HIGHLIGHTS 0
#define HALF 0
#define NORMALS 0
#define COLORS 0
#include "include/surface.glsl"
#include "include/clusters.glsl"
#else
flat in vec4 v_color;
#endif

#if VIEW == 0
out float o_overdraw;
#elif VIEW == 1
out vec4 o_volumes;
#else
out vec4 o_wireframe;
#endif

// so that some volumes, or lines, over each other can be told apart
const float FAINT = 0.12;
const float LINE = 0.3;

#if METHOD == 4

void main()
{
    Cell cell = find_cell(read_place(ivec2(gl_FragCoord.xy)));
    o_overdraw = 0.0;
    for (int word = cell.word; word < cell.end; word += 4)
        for (uvec4 bits = words_at(cell, word); bits != uvec4(0u); bits &= bits - min(bits, 1u))
            o_overdraw += dot(vec4(min(bits, 1u)), vec4(1.0));
}

#else

void main()
{
    vec3 hue = v_color.rgb / max(max(v_color.r, v_color.g), max(v_color.b, 1e-30));
#if VIEW == 0
    o_overdraw = 1.0;
#elif VIEW == 1
    o_volumes = vec4(hue * FAINT, 1.0);
#else
    o_wireframe = vec4(hue * LINE, 1.0);
#endif
}

#endif
