// Provides Cell, find_cell, next_light: the lights that may reach the surface at a pixel. After surface.glsl.
// A cell has a bit mask, with a bit per light of its depth slice: firefly_sample/plan/lights/clusters.py.
// Float64 twin: cell_masks and the functions after it, in the same module

uniform usampler2D u_slices;  // per slice: both edges, its first word, the next slice's first word
uniform int u_slice_count;
uniform usampler2D u_masks;   // words of bit masks: four per texel; one row per line of tiles
uniform ivec3 u_tiling;       // samples along a tile's side, tiles across and up
uniform ivec4 u_first_lines;  // of tile columns, tile rows, rising and falling diagonals
uniform vec4 u_slicing;       // scale, offset from log2(distance) (orthographic: distance) to slice; first, last edge

struct Cell {
    int word;      // first word of its slice
    int end;
    ivec4 lines;   // of its tile column, tile row, rising and falling diagonal
};

// Returns four words of a cell's bit mask: the bitwise AND of its column's, row's and two diagonals'.
uvec4 masks_at(Cell cell, int word)
{
    int i = word >> 2;
    return texelFetch(u_masks, ivec2(i, cell.lines.x), 0) & texelFetch(u_masks, ivec2(i, cell.lines.y), 0)
        & texelFetch(u_masks, ivec2(i, cell.lines.z), 0) & texelFetch(u_masks, ivec2(i, cell.lines.w), 0);
}

ivec2 tile_of(Surface s)
{
#if HAS_PLACE
    // a stored position need not lie on its pixel's ray
    vec4 clip = view_to_clip(s.place);
    vec2 pixel = clip.xy / clip.w * u_size.zw + u_size.zw;
#else
    vec2 pixel = s.pixel;
#endif
    return clamp(ivec2(pixel / float(u_tiling.x)), ivec2(0), u_tiling.yz - 1);
}

Cell find_cell(Surface s)
{
    int slices = u_slice_count;
    if (!(s.y >= u_slicing.z && s.y <= u_slicing.w))
        return Cell(0, 0, ivec4(0));  // background, or beyond the reach of all lights
#if ORTHOGRAPHIC
    float guess = s.y * u_slicing.x + u_slicing.y;
#else
    float guess = log2(s.y) * u_slicing.x + u_slicing.y;
#endif
    int k = clamp(int(floor(guess)), 0, slices - 1);
    uvec4 slice = texelFetch(u_slices, ivec2(k, 0), 0);
    // drivers' logarithms differ in the last digits: compare with the exact edges
    if (s.y < uintBitsToFloat(slice.x))
        --k;
    else if (k + 1 < slices && s.y >= uintBitsToFloat(slice.y))
        ++k;
    slice = texelFetch(u_slices, ivec2(k, 0), 0);
    ivec2 tile = tile_of(s);
    ivec4 along = ivec4(tile, tile.x + tile.y, tile.x + u_tiling.z - 1 - tile.y);
    return Cell(int(slice.z), int(slice.w), u_first_lines + along);
}

// Returns the index of the next light in four words, and clears its bit.
int next_light(int word, inout uvec4 bits)
{
    int i = bits.x != 0u ? 0 : bits.y != 0u ? 1 : bits.z != 0u ? 2 : 3;
    uint one = bits.x != 0u ? bits.x : bits.y != 0u ? bits.y : bits.z != 0u ? bits.z : bits.w;
    uint lowest = one & (~one + 1u);
    bits ^= uvec4(equal(ivec4(i), ivec4(0, 1, 2, 3))) * lowest;
    int bit = int(floatBitsToUint(float(lowest)) >> 23) - 127;  // exact, because lowest is a power of two
    return 32 * (word + i) + bit;
}
