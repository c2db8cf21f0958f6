// Provides STEEP_BIT, the bit of a triangle's index that marks pixels where its values change too much from one pixel
// to the next for a rasterizer to interpolate them accurately.

const uint STEEP_BIT = 0x80000000u;
