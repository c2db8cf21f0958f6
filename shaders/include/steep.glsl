// Provides STEEP_BIT, of the number of a triangle: its values change too much from pixel to pixel for a rasterizer.

const uint STEEP_BIT = 0x80000000u;
