// Provides tile_corner, the lower left texel of a slice's tile, and texel_in_tile. Slice 0 is at the lower left; rows
// go up.
#block ParticleShadow

ivec2 tile_corner(int slice)
{
    int across = int(u_particle_shadow_tiles.y);
    return int(u_particle_shadow_tiles.x) * ivec2(slice % across, slice / across);
}

ivec2 texel_in_tile(ivec2 texel)
{
    return texel % int(u_particle_shadow_tiles.x);
}
