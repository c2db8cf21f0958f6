// Provides rests: the rounding errors of three float32 numbers, packed into one number with a byte each. A byte counts
// 1/256 of the number's last binary digit; 128 is 0. Unpacking is exact on every driver and saves a texel fetch.
// Float64 twin: firefly_sample/gpu/light_records.py

vec3 rests(vec3 held, float bytes)
{
    uint word = uint(bytes);
    vec3 steps = vec3(word & 255u, word >> 8 & 255u, word >> 16) - 128.0;
    vec3 binade = uintBitsToFloat(floatBitsToUint(held) & 0x7f800000u);
    return steps * (binade * 4.656612873077393e-10);  // 2^-31
}
