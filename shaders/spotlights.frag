#version 330 core
// Adds spotlights to the surfaces within their cones and their reach.
#define PLACED 1
#define KIND 3
#include "include/surface.glsl"
#include "include/arrives.glsl"
#include "include/light_pass.glsl"
