#version 330 core
// Turns samples into the picture: fills in the background, averages, and applies exposure, tone curve and sRGB.
// LOOK_PYRENDER: each sample is encoded first, by the power 1/2.2; layers are mixed, and samples averaged, as display
// values, as pyrender does in a framebuffer of 8 bits. LOOK_FLAT: the same of base colours, which are display values.
// LOOK_CLASSIC: radiance is display values. LOOK_PANDA3D: so it is, up to 1; TINT multiplies it, and GLOSS is added.
#include "include/color.glsl"
#if LOOK == LOOK_PYRENDER
#include "include/codes.glsl"
#endif
#if GRADIENT
#include "include/lens.glsl"
#endif
#block Shading

#if RADIANCE
uniform sampler2D u_radiance;
#endif
#ifdef TINT
uniform sampler2D u_tint;
#endif
#ifdef GLOSS
uniform sampler2D u_gloss;
#endif
#if PARTICLES
uniform sampler2D u_particles;
#endif
#ifdef TRANSPARENCY
uniform sampler2D u_transparency;
#if TRANSPARENCY == TRANSPARENCY_WEIGHTED
uniform sampler2D u_transparency_weight;
#endif
#endif
#if MARKED
uniform sampler2D u_coverage;
#define COVERED texelFetch(u_coverage, texel, 0).r
#elif MASKED
#if PACKED
uniform usampler2D u_albedo;
#define COVERED float(texelFetch(u_albedo, texel, 0).r)
#else
uniform sampler2D u_albedo;
#define COVERED texelFetch(u_albedo, texel, 0).a
#endif
#endif
#if COLOR
out vec4 o_color;
#endif
#if FINAL_RADIANCE
out vec4 o_final_radiance;
#endif
#ifdef COLOR_ALPHA
out vec4 o_color_alpha;
#endif

const float LARGEST = 3e38;

vec3 background(vec2 pixel)
{
#if GRADIENT
#if ORTHOGRAPHIC
    vec3 ray = vec3(0.0, 1.0, 0.0);
#else
    vec3 ray = view_from_distance(ndc_from_pixel(pixel), 1.0);
#endif
    float elevation = dot(u_up.xyz, ray) / length(ray);
    return mix(u_horizon.rgb, u_zenith.rgb, sqrt(max(elevation, 0.0)));
#else
    return u_horizon.rgb;
#endif
}

// Returns the light of surfaces, or what the look has in its place, without the background.
vec3 surface_at(ivec2 texel)
{
#if LOOK == LOOK_FLAT && MASKED
    return texelFetch(u_albedo, texel, 0).rgb;
#elif LOOK == LOOK_PANDA3D && RADIANCE
    vec3 value = min(texelFetch(u_radiance, texel, 0).rgb, 1.0);
#ifdef TINT
    value *= texelFetch(u_tint, texel, 0).rgb;
#endif
#ifdef GLOSS
    value += texelFetch(u_gloss, texel, 0).rgb;
#endif
    return value;
#elif RADIANCE
    return min(texelFetch(u_radiance, texel, 0).rgb, LARGEST);  // a target of small floats may hold infinity
#else
    return vec3(0.0);
#endif
}

vec3 behind_layer(ivec2 texel)
{
    vec3 value = surface_at(texel);
#if MASKED
    if (COVERED > 0.0)
        return value;
#endif
#if LOOK == LOOK_CLASSIC
    return value + linear_to_srgb(background(vec2(texel) + 0.5));
#elif LOOK == LOOK_FLAT
    return clamp(background(vec2(texel) + 0.5), 0.0, 1.0);
#else
    return value + background(vec2(texel) + 0.5);
#endif
}

// Returns what samples are averaged as, of a sample's radiance.
vec3 displayed(vec3 value)
{
#if LOOK == LOOK_PYRENDER
    return power_encoded(value * u_exposure.rgb);
#elif LOOK == LOOK_PANDA3D
    return clamp(value, 0.0, 1.0);
#else
    return value;
#endif
}

#if PARTICLES || defined(TRANSPARENCY)
// Returns the light of the layer in front of surfaces, and the share of what is behind that it hides.
vec4 layer_at(ivec2 texel)
{
#if PARTICLES
    return texelFetch(u_particles, texel, 0);
#elif TRANSPARENCY == TRANSPARENCY_WEIGHTED
    vec4 sum = texelFetch(u_transparency, texel, 0);
    float weight = texelFetch(u_transparency_weight, texel, 0).r;
    return vec4(weight > 0.0 ? sum.rgb * (sum.a / weight) : vec3(0.0), sum.a);
#else
    return texelFetch(u_transparency, texel, 0);
#endif
}
#endif

vec3 sample_at(ivec2 texel)
{
    vec3 value = displayed(behind_layer(texel));
#if PARTICLES || defined(TRANSPARENCY)
    vec4 over = layer_at(texel);
    value = value * (1.0 - over.a) + over.rgb;
#endif
    return value;
}

#if FINAL_RADIANCE && LOOK == LOOK_PYRENDER
// Returns a sample's radiance: where layers are mixed, that of the display value which they make.
vec3 sample_radiance(ivec2 texel)
{
#ifdef TRANSPARENCY
    if (any(greaterThan(layer_at(texel), vec4(0.0))))
        return power_decoded(sample_at(texel)) / u_exposure.rgb;
#endif
    return behind_layer(texel);
}
#endif

#ifdef COLOR_ALPHA
// Returns the light of all that is before the background, and the share of the background that it hides.
vec4 sample_foreground(ivec2 texel)
{
    vec4 value = vec4(displayed(surface_at(texel)), 0.0);
#if MASKED
    value.a = COVERED > 0.0 ? 1.0 : 0.0;
#endif
#if PARTICLES || defined(TRANSPARENCY)
    vec4 over = layer_at(texel);
    value = value * (1.0 - over.a) + over;
#endif
    return value;
}

#if LOOK != LOOK_CORRECT
// Returns straight alpha: the display value of what covers a share of the background, as if it covered all of it.
vec4 straight_alpha(vec4 foreground)
{
    // the colour is that of the stored alpha, so that rounding alpha does not change what is seen over black
    float alpha = floor(clamp(foreground.a, 0.0, 1.0) * 255.0 + 0.5) / 255.0;
    return vec4(alpha > 0.0 ? min(foreground.rgb / alpha, 1.0) : vec3(0.0), alpha);
}
#else
// The radiance whose code is 254.5: what is brighter is white.
#if TONE == TONE_EXPONENTIAL
const float WHITE = 5.41378;
#else
const float WHITE = 0.995545;
#endif
const float INVISIBLE = 0.02;  // codes of alpha: so little light has no code, even over black

// Returns straight alpha: the colour of what covers a share of the background, as if it covered all of it. Light that
// is too bright for its share, as that of a dot is, which covers nothing, raises the share until its colour is white.
vec4 straight_alpha(vec4 foreground)
{
    vec3 light = max(foreground.rgb * u_exposure.rgb, vec3(0.0));
    float share = clamp(foreground.a, 0.0, 1.0) * 255.0;
    float raised = clamp(max(light.r, max(light.g, light.b)) / WHITE, 0.0, 1.0) * 255.0;
    float code = max(floor(share + 0.5), ceil(raised - INVISIBLE));
    // the colour is that of the stored alpha, so that rounding alpha does not change what is seen over black
    float alpha = code / 255.0;
    return vec4(alpha > 0.0 ? linear_to_srgb(tone_curve(light / alpha)) : vec3(0.0), alpha);
}
#endif
#endif

void main()
{
    vec3 sum = vec3(0.0);
    ivec2 first = ivec2(gl_FragCoord.xy) * SUPERSAMPLE;
    for (int y = 0; y < SUPERSAMPLE; ++y)
        for (int x = 0; x < SUPERSAMPLE; ++x)
            sum += sample_at(first + ivec2(x, y));
    vec3 value = sum / float(SUPERSAMPLE * SUPERSAMPLE);
#ifdef COLOR_ALPHA
    vec4 foreground = vec4(0.0);
    for (int y = 0; y < SUPERSAMPLE; ++y)
        for (int x = 0; x < SUPERSAMPLE; ++x)
            foreground += sample_foreground(first + ivec2(x, y));
    o_color_alpha = straight_alpha(foreground / float(SUPERSAMPLE * SUPERSAMPLE));
#endif
#if FINAL_RADIANCE
#if LOOK == LOOK_PYRENDER
    vec3 radiance = vec3(0.0);
    for (int y = 0; y < SUPERSAMPLE; ++y)
        for (int x = 0; x < SUPERSAMPLE; ++x)
            radiance += sample_radiance(first + ivec2(x, y));
    o_final_radiance = vec4(radiance / float(SUPERSAMPLE * SUPERSAMPLE), 1.0);
#else
    o_final_radiance = vec4(value, 1.0);
#endif
#endif
#if COLOR
#if LOOK == LOOK_CORRECT
    o_color = vec4(linear_to_srgb(tone_curve(value * u_exposure.rgb)), 1.0);
#else
    o_color = vec4(value, 1.0);  // already display values
#endif
#endif
}
