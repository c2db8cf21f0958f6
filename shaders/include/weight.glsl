// Provides weight_at: the weight of what is blended at a distance, in sums without an order.
// It falls by the third power between the nearest and the farthest such thing, as equation 10 of McGuire and Bavoil.
// Float64 twin: firefly_sample/lab/reference/layers.py
uniform vec2 u_blended_range;  // distance of the nearest, and one over the length of the range

float weight_at(float y)
{
    float share = clamp((y - u_blended_range.x) * u_blended_range.y, 0.0, 1.0);
    float left = 1.0 - share;
    return max(1e-2, 3e3 * left * left * left);
}
