// Provides unit_normal: normalizes an interpolated normal.

// A normal of length 0 is replaced by one that faces the eye, so that the surface is lit. The normal of a two-sided
// surface is turned towards the eye. For pyrender, the eye of an orthographic camera is in its position.
vec3 unit_normal(vec3 normal, vec3 view, bool two_sided)
{
#if ORTHOGRAPHIC && !(defined(PYRENDER) && defined(METALLIC))
    vec3 ahead = vec3(0.0, 1.0, 0.0);
#else
    vec3 ahead = view;
#endif
    float length2 = dot(normal, normal);
    float largest = max(max(abs(ahead.x), abs(ahead.z)), max(ahead.y, 1e-37));  // no square overflows
    vec3 n = length2 > 1e-30 ? normal * inversesqrt(length2) : -normalize(ahead / largest);
    return two_sided && dot(n, ahead) > 0.0 ? -n : n;
}
