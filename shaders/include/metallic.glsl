// Provides head_on and ambient_reflectance of metallic-roughness surfaces, and reflected: what they do to one light.
// glTF 2.0, appendix B.3: GGX microfacets with separable Smith masking, Schlick's Fresnel term, and a Lambertian base.
// Light has the units of this package: times pi, so that a white matt surface reflects its colour.
// PYRENDER: pyrender's formula, which has Schlick's approximation of Smith masking, reflects 4 % less diffusely, and lets
// a light also reach surfaces that face away.
// Float64 twin: firefly_sample/lab/reference/metallic.py

const float DIELECTRIC = 0.04;       // reflectance head on, for a refractive index of 1.5
#ifdef PYRENDER
const float SMOOTHEST = 0.04;        // roughness
const float GRAZING = 0.001;         // the least cosine
#else
const float SMOOTHEST = 1.0 / 32.0;  // roughness; float32 has no digits for sharper highlights
#endif

// Returns the reflectance of light that arrives along the normal.
vec3 head_on(vec3 base, float metallic)
{
    return mix(vec3(DIELECTRIC), base, metallic);
}

vec3 diffuse_color(vec3 base, float metallic)
{
#ifdef PYRENDER
    base *= 1.0 - DIELECTRIC;
#endif
    return base * (1.0 - metallic);
}

// Light that is the same from everywhere is reflected as by a smooth surface that is seen head on.
vec3 ambient_reflectance(vec3 base, float metallic)
{
#ifdef PYRENDER
    return base;
#else
    vec3 f0 = head_on(base, metallic);
    return f0 + (1.0 - f0) * diffuse_color(base, metallic);
#endif
}

// Returns 4 (n.l) (n.e) over the share of microfacets that light and eye both see.
float masking(float n_dot_l, float n_dot_e, float roughness, float a2)
{
#ifdef PYRENDER
    n_dot_e = max(n_dot_e, GRAZING);
    float k = 1.0 + max(roughness, SMOOTHEST);
    k *= 0.125 * k;
    return (n_dot_l * (1.0 - k) + k) * (n_dot_e * (1.0 - k) + k) * (4.0 + 0.001 / (n_dot_l * n_dot_e));
#else
    return (n_dot_l + sqrt(a2 + (1.0 - a2) * n_dot_l * n_dot_l))
        * (n_dot_e + sqrt(a2 + (1.0 - a2) * n_dot_e * n_dot_e));
#endif
}

// Returns the share of light that a highlight reflects, times pi, by channel; passed is the share that the base gets.
// All vectors are unit vectors.
vec3 reflected(vec3 f0, float roughness, vec3 n, vec3 to_light, vec3 to_eye, float n_dot_l, out vec3 passed)
{
    float a = max(roughness, SMOOTHEST);
    a *= a;
    float a2 = a * a;
    vec3 h = to_light + to_eye;
    h *= inversesqrt(max(dot(h, h), 1e-30));
    float grazing = 1.0 - min(abs(dot(to_eye, h)), 1.0);
    float square = grazing * grazing;
    vec3 fresnel = f0 + (1.0 - f0) * (square * square * grazing);
    passed = 1.0 - fresnel;
    float n_dot_h = dot(n, h);
#ifndef PYRENDER
    if (n_dot_h <= 0.0)
        return vec3(0.0);
#endif
    // (n.h)^2 (a^2 - 1) + 1 would lose its digits where n.h is almost 1
    vec3 across = cross(n, h);
    float spread = dot(across, across) + a2 * n_dot_h * n_dot_h;
#ifdef PYRENDER
    if (n_dot_h <= 0.0)
        spread = 1.0;
#endif
    return fresnel * (a2 / (spread * spread * masking(n_dot_l, abs(dot(n, to_eye)), roughness, a2)));
}
