// Provides rests: what float32 took of three numbers. One number has it all, a byte each: how many 256ths of the
// number's last digit, 128 for nothing. Exact on every driver, and a texel less to fetch.
// Float64 twin: firefly_sample/gpu/light_rows.py

vec3 rests(vec3 held, float bytes)
{
    uint word = uint(bytes);
    vec3 steps = vec3(word & 255u, word >> 8 & 255u, word >> 16) - 128.0;
    vec3 binade = uintBitsToFloat(floatBitsToUint(held) & 0x7f800000u);
    return steps * (binade * 4.656612873077393e-10);  // 2^-31
}
