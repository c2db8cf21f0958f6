#version 330 core
// Adds directional lights, which reach every surface. The surface's position is needed only for shadows, and where the
// rays of an orthographic camera meet in its position.
#if ORTHOGRAPHIC && ((defined(PYRENDER) && defined(METALLIC_ROUGHNESS)) || defined(LOCAL_VIEWERS))
#define PLACED 1
#else
#define PLACED (SHADOW_TAPS > 0 || PARTICLE_SHADOW)
#endif
#define LIGHT_KIND LIGHT_KIND_DIRECTIONAL
#include "include/surface.glsl"
#include "include/arrives.glsl"
#include "include/light_pass.glsl"
