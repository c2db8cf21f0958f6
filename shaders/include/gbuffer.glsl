// Provides encode_albedo, decode_albedo, encode_normal, decode_normal: the packing beside its unpacking.
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

vec3 decode_normal(vec4 stored)
{
    vec2 e = stored.xy;
#if !SNORM
    e = e * 2.0 - 1.0;
#endif
    vec3 n = vec3(e, 1.0 - abs(e.x) - abs(e.y));
    if (n.z < 0.0)
        n.xy = (1.0 - abs(n.yx)) * sign_not_zero(n.xy);
    return normalize(n);
}

#endif
