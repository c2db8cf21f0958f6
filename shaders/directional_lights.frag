#version 330 core
// Adds directional lights, which reach every surface. The surface's position is needed only for shadows.
#define PLACED (SHADOW_TAPS > 0 || PARTICLE_SHADOW)
#define LIGHT_KIND LIGHT_KIND_DIRECTIONAL
#include "include/surface.glsl"
#include "include/arrives.glsl"
#include "include/light_pass.glsl"
