// Provides tile_corner: the first texel of a slice's tile; and texel_in_tile. Slice 0 is lower left, rows go up.
#block Volume

ivec2 tile_corner(int slice)
{
    int across = int(u_volume_tiles.y);
    return int(u_volume_tiles.x) * ivec2(slice % across, slice / across);
}

ivec2 texel_in_tile(ivec2 texel)
{
    return texel % int(u_volume_tiles.x);
}
