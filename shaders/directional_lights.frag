#version 330 core
// Adds directional lights, which reach every surface. Where it is matters only for its shadows.
#define PLACED (TAPS > 0 || PARTICLE_SHADOW)
#define KIND 1
#include "include/surface.glsl"
#include "include/arrives.glsl"
#include "include/light_pass.glsl"
