// Provides METALLIC_MAP, NORMAL_MAP, OCCLUSION_MAP and MODULATE_MAP, 0 for what a draw lacks, 1 for a texture at the first
// texture coordinates and 2 for one at the second; TEXCOORDS_1, whether there are second ones; BY_PYRENDER, whether pyrender's
// formula shades the draw's surfaces, which are metallic-roughness ones; and BY_PANDA3D, whether Panda3D's shades them, which
// are not.
#ifndef METALLIC_MAP
#define METALLIC_MAP 0
#endif
#ifndef NORMAL_MAP
#define NORMAL_MAP 0
#endif
#ifndef OCCLUSION_MAP
#define OCCLUSION_MAP 0
#endif
#ifndef MODULATE_MAP
#define MODULATE_MAP 0
#endif
#define TEXCOORDS_1 (SECOND_TEXCOORDS || METALLIC_MAP == 2 || NORMAL_MAP == 2 || OCCLUSION_MAP == 2 || MODULATE_MAP == 2)
#if defined(PYRENDER) && defined(METALLIC)
#define BY_PYRENDER 1
#else
#define BY_PYRENDER 0
#endif
#if defined(PANDA3D) && !defined(METALLIC)
#define BY_PANDA3D 1
#else
#define BY_PANDA3D 0
#endif
