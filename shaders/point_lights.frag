#version 330 core
// Adds point lights to the surfaces that they reach.
#define PLACED 1
#define KIND 2
#include "include/surface.glsl"
#include "include/arrives.glsl"
#include "include/light_pass.glsl"
