// Provides encode_ and decode_ of albedo, normal, specular and viewer, and pack_color, unpack_color.
// ALBEDO_FORMAT_LINEAR: the colour itself. _SQRT8: square roots. _SQRT10: square roots, ten bits each of an integer, which
// every driver stores exactly; for a normalised target of ten bits, llvmpipe takes a sixth of the geometry pass to convert.
// NORMAL_FORMAT_OCT16, _OCT16_UNORM, _OCT8: octahedral, in signed 16, unsigned 16 and unsigned 8 bits (Cigolle et al.,
// JCGT 3(2), 2014). _UNORM: n/2 + 1/2. _FLOAT: n. _CLASSIC: the faults of Panda3D's sample: n/2 + 1/2 in OpenGL's view
// axes (x right, y up, z to the viewer), read as it is, as if it were a normal in view axes with y forward and z up.
// Float64 twin: firefly_sample/packing.py

#if ALBEDO_FORMAT == ALBEDO_FORMAT_SQRT10

#define COLOR_TEXEL uint
#define COLOR_SAMPLER usampler2D

// The two highest bits mark pixels where something was drawn.
uint pack_color(vec3 color)
{
    uvec3 code = uvec3(sqrt(clamp(color, 0.0, 1.0)) * 1023.0 + 0.5);
    return code.r | code.g << 10 | code.b << 20 | 3u << 30;
}

vec3 unpack_color(uvec4 texel)
{
    vec3 root = vec3(texel.r & 1023u, texel.r >> 10 & 1023u, texel.r >> 20 & 1023u) / 1023.0;
    return root * root;
}

#else

#define COLOR_TEXEL vec4
#define COLOR_SAMPLER sampler2D

vec3 encode_albedo(vec3 albedo)
{
#if ALBEDO_FORMAT == ALBEDO_FORMAT_SQRT8
    return sqrt(clamp(albedo, 0.0, 1.0));
#else
    return albedo;
#endif
}

vec3 decode_albedo(vec3 stored)
{
#if ALBEDO_FORMAT != ALBEDO_FORMAT_LINEAR
    return stored * stored;
#else
    return stored;
#endif
}

// Alpha marks pixels where something was drawn.
vec4 pack_color(vec3 color)
{
    return vec4(encode_albedo(color), 1.0);
}

vec3 unpack_color(vec4 texel)
{
    return decode_albedo(texel.rgb);
}

#endif

// Stores the square root of the colour, as for albedo, and the logarithm of a shininess from 0 to 2^20; 16 bits each.
vec4 encode_specular(vec3 color, float shininess)
{
    return vec4(sqrt(clamp(color, 0.0, 1.0)), log2(1.0 + shininess) / 20.0);
}

const float LARGEST_HALF = 65504.0;

// Stores whether highlights see the eye where it is in the highest of 16 bits, and a number of 0 to 1 in the others.
float encode_viewer(float value, bool local)
{
    return (floor(value * 32767.0 + 0.5) + (local ? 32768.0 : 0.0)) / 65535.0;
}

float decode_viewer(float stored, out bool local)
{
    float code = floor(stored * 65535.0 + 0.5);
    local = code >= 32768.0;
    return (code - (local ? 32768.0 : 0.0)) / 32767.0;
}

vec4 decode_specular(vec4 stored)
{
    return vec4(stored.rgb * stored.rgb, exp2(20.0 * stored.a) - 1.0);
}

// Stores 0 for surfaces of another model, which decode to a metalness below 0.
vec2 encode_metallic(float metallic, float roughness)
{
    return vec2((1.0 + 65534.0 * clamp(metallic, 0.0, 1.0)) / 65535.0, clamp(roughness, 0.0, 1.0));
}

vec2 decode_metallic(vec2 stored)
{
    float code = floor(stored.x * 65535.0 + 0.5);
    return vec2((code - 1.0) / 65534.0, stored.y);
}

#if NORMAL_FORMAT < NORMAL_FORMAT_UNORM

vec2 sign_not_zero(vec2 v)
{
    return vec2(v.x >= 0.0 ? 1.0 : -1.0, v.y >= 0.0 ? 1.0 : -1.0);
}

vec4 encode_normal(vec3 n)
{
    vec3 a = n / (abs(n.x) + abs(n.y) + abs(n.z));
    vec2 e = a.z >= 0.0 ? a.xy : (1.0 - abs(a.yx)) * sign_not_zero(a.xy);
#if NORMAL_FORMAT == NORMAL_FORMAT_OCT16_UNORM
    e = e * 0.5 + 0.5;
#elif NORMAL_FORMAT == NORMAL_FORMAT_OCT8
    e = (floor(e * 127.0 + 0.5) + 127.0) / 255.0;  // 254 steps, so that 0 is one of them
#endif
    return vec4(e, 0.0, 0.0);
}

// Stored values are integers divided by 32767, 65535 or 255. In these units, all steps before normalize are exact.
vec3 decode_normal(vec4 stored)
{
#if NORMAL_FORMAT == NORMAL_FORMAT_OCT16
    const float ONE = 32767.0;
    vec2 e = floor(stored.xy * ONE + 0.5);
#elif NORMAL_FORMAT == NORMAL_FORMAT_OCT16_UNORM
    const float ONE = 65535.0;
    vec2 e = 2.0 * floor(stored.xy * ONE + 0.5) - ONE;
#else
    const float ONE = 127.0;
    vec2 e = floor(stored.xy * 255.0 + 0.5) - ONE;
#endif
    vec3 n = vec3(e, ONE - abs(e.x) - abs(e.y));
    if (n.z < 0.0)
        n.xy = (ONE - abs(n.yx)) * sign_not_zero(n.xy);
    return normalize(n);
}

#else

vec4 encode_normal(vec3 n)
{
#if NORMAL_FORMAT == NORMAL_FORMAT_FLOAT
    return vec4(n, 0.0);
#elif NORMAL_FORMAT == NORMAL_FORMAT_CLASSIC
    return vec4(vec3(n.x, n.z, -n.y) * 0.5 + 0.5, 0.0);
#else
    return vec4(n * 0.5 + 0.5, 0.0);
#endif
}

vec3 decode_normal(vec4 stored)
{
#if NORMAL_FORMAT == NORMAL_FORMAT_CLASSIC
    return stored.xyz;
#else
#if NORMAL_FORMAT == NORMAL_FORMAT_FLOAT
    vec3 n = stored.xyz;
#else
    vec3 n = stored.xyz * 2.0 - 1.0;
#endif
    return n * inversesqrt(max(dot(n, n), 1e-30));  // 0 where nothing was drawn
#endif
}

#endif
