#version 330 core
// Adds point lights to the surfaces that they reach.
#define PLACED 1
#define LIGHT_KIND LIGHT_KIND_POINT
#include "include/surface.glsl"
#include "include/arrives.glsl"
#include "include/light_pass.glsl"
