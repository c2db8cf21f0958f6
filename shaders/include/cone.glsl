// Provides opening: 1 - cos of an angle, from its cosine and the square of its sine.
// Provides cone_strength: the strength of a spotlight in a direction. axis.w is 1 - cos of the outer half-angle; cone.x
// is one over the width of the edge, 0 for a hard one; cone.y is an exponent of the cosine.
// PYRENDER: the edge is a square, and at least 1/1000 wide.
// Float64 twin: firefly_sample/lab/reference/shading.py
#include "include/phong.glsl"

// 1 - c has no correct digits left below a degree
float opening(float c, float sine2)
{
    return c > 0.0 ? sine2 / (1.0 + c) : 1.0 - c;
}

float cone_strength(vec3 to_light, vec4 axis, vec4 cone)
{
    float c = -dot(to_light, axis.xyz);
    vec3 across = cross(to_light, axis.xyz);
    float sine2 = dot(across, across);
    float opened = opening(c, sine2);
    if (opened > axis.w)
        return 0.0;
    float strength = power_of_cosine(c, sine2, cone.y);
#ifdef PYRENDER
    float t = min((axis.w - opened) * (cone.x > 0.0 ? min(cone.x, 1000.0) : 1000.0), 1.0);
    strength *= t * t;
#else
    if (cone.x > 0.0) {
        float t = min((axis.w - opened) * cone.x, 1.0);
        strength *= t * t * (3.0 - 2.0 * t);
    }
#endif
    return strength;
}
