// Provides encode_ and decode_ of albedo, normal and specular: the packing beside its unpacking.
// CLASSIC keeps what Panda3D's sample keeps: colours as stored, n * 0.5 + 0.5, and no decoding of it.
// Octahedral normals: Cigolle et al., JCGT 3(2), 2014. SNORM 0 means a 0..1 target: shift and scale.
// Float64 twin: firefly_sample/reference/gbuffer.py

vec3 encode_albedo(vec3 albedo)
{
#if CLASSIC
    return albedo;
#else
    return sqrt(clamp(albedo, 0.0, 1.0));
#endif
}

vec3 decode_albedo(vec3 stored)
{
#if CLASSIC
    return stored;
#else
    return stored * stored;
#endif
}

// Colour by square roots, as albedo; shininess by a logarithm from 0 to 2^20. Sixteen bits each.
vec4 encode_specular(vec3 color, float shininess)
{
    return vec4(sqrt(clamp(color, 0.0, 1.0)), log2(1.0 + shininess) / 20.0);
}

vec4 decode_specular(vec4 stored)
{
    return vec4(stored.rgb * stored.rgb, exp2(20.0 * stored.a) - 1.0);
}

#if CLASSIC

vec4 encode_normal(vec3 n)
{
    return vec4(n * 0.5 + 0.5, 0.0);
}

vec3 decode_normal(vec4 stored)
{
    return stored.xyz;  // the original never decodes it
}

#else

vec2 sign_not_zero(vec2 v)
{
    return vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

vec4 encode_normal(vec3 n)
{
    vec3 a = n / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 e = a.z >= 0.0 ? a.xy : (1.0 - abs(a.yx)) * sign_not_zero(a.xy);
#if !SNORM
    e = e * 0.5 + 0.5;
#endif
    return vec4(e, 0.0, 0.0);
}

// The stored numbers are whole numbers over 32767 or 65535. In these units all up to normalize is exact.
vec3 decode_normal(vec4 stored)
{
#if SNORM
    const float ONE = 32767.0;
    vec2 e = floor(stored.xy * ONE + 0.5);
#else
    const float ONE = 65535.0;
    vec2 e = 2.0 * floor(stored.xy * ONE + 0.5) - ONE;
#endif
    vec3 n = vec3(e, ONE - abs(e.x) - abs(e.y));
    if (n.z < 0.0)
        n.xy = (ONE - abs(n.yx)) * sign_not_zero(n.xy);
    return normalize(n);
}

#endif
