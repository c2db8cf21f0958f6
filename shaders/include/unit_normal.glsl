// Provides unit_normal: what a surface keeps of an interpolated normal.

// One without a length faces the eye: a surface must not become a hole. That of a two-sided surface is turned there.
vec3 unit_normal(vec3 normal, vec3 view, bool two_sided)
{
#if ORTHOGRAPHIC
    vec3 ahead = vec3(0.0, 1.0, 0.0);
#else
    vec3 ahead = view;
#endif
    float length2 = dot(normal, normal);
    float largest = max(max(abs(ahead.x), abs(ahead.z)), max(ahead.y, 1e-37));  // at every scale
    vec3 n = length2 > 1e-30 ? normal * inversesqrt(length2) : -normalize(ahead / largest);
    return two_sided && dot(n, ahead) > 0.0 ? -n : n;
}
