// Provides Cell, find_cell, next_light: the lights that may reach what is behind a pixel. For after surface.glsl.
// A cell has a bit for each light of its depth slice: firefly_sample/plan/clusters.py.
// Float64 twin: firefly_sample/reference/clusters.py

uniform usampler2D u_slices;  // of each slice both edges, its first word and the next one's: gpu/cluster_rows.py
uniform int u_slice_count;
uniform usampler2D u_words;
uniform ivec4 u_tiling;       // samples along a tile's side, tiles across and up, words a tile
uniform vec4 u_slicing;       // from log2 of the distance, orthographic the distance, to slices; first and last edge

struct Cell {
    int word;   // the next one
    int end;
    int base;   // of this tile's words
};

uint word_at(int i)
{
    return texelFetch(u_words, ivec2(i & 2047, i >> 11), 0).r;
}

ivec2 tile_of(Surface s)
{
#if HAS_PLACE
    // which need not lie on the way through its pixel
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
        return Cell(0, 0, 0);  // what no light reaches, and the background
#if ORTHOGRAPHIC
    float guess = s.y * u_slicing.x + u_slicing.y;
#else
    float guess = log2(s.y) * u_slicing.x + u_slicing.y;
#endif
    int k = clamp(int(floor(guess)), 0, slices - 1);
    uvec4 slice = texelFetch(u_slices, ivec2(k, 0), 0);
    // drivers' logarithms differ in their last digits: the edges themselves decide
    if (s.y < uintBitsToFloat(slice.x))
        --k;
    else if (k + 1 < slices && s.y >= uintBitsToFloat(slice.y))
        ++k;
    slice = texelFetch(u_slices, ivec2(k, 0), 0);
    ivec2 tile = tile_of(s);
    return Cell(int(slice.z), int(slice.w), (tile.y * u_tiling.y + tile.x) * u_tiling.w);
}

// The number of a word's next light; the word's bits are taken off one by one.
int next_light(int word, inout uint bits)
{
    uint lowest = bits & (~bits + 1u);
    bits &= bits - 1u;
    int bit = int(floatBitsToUint(float(lowest)) >> 23) - 127;  // of a power of two, exactly
    return 32 * word + bit;
}
