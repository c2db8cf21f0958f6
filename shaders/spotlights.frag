#version 330 core
// Adds spotlights to the surfaces within their cones and their reach.
#define PLACED 1
#define LIGHT_KIND LIGHT_KIND_SPOT
#include "include/surface.glsl"
#include "include/arrives.glsl"
#include "include/light_pass.glsl"
