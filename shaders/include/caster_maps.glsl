// Provides MODULATE_MAP, 0 for a caster without a second texture, 1 for one at the first texture coordinates and 2 for one at
// the second; CUTOUT, whether alpha cuts the caster out; and TEXCOORDS, whether first texture coordinates are used.
#ifndef MODULATE_MAP
#define MODULATE_MAP 0
#endif
#define CUTOUT (TEXTURED || VERTEX_ALPHA || MODULATE_MAP)
#define TEXCOORDS (TEXTURED || MODULATE_MAP == 1)
