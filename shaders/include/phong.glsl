// Provides power_of_cosine, and highlight: the share of a light that a shiny surface reflects to the eye.
// SPECULAR_MODEL_PHONG or SPECULAR_MODEL_BLINN_PHONG. All vectors are unit vectors.
// Float64 twin: firefly_sample/lab/reference/shading.py

// Returns cos^m from the cosine and the square of the sine. If m is large, only angles near 0 matter. There the float32
// cosine is rounded to almost 1, so pow would be inaccurate; the sine is accurate.
float power_of_cosine(float c, float sine2, float m)
{
    if (m == 0.0)
        return 1.0;
    if (c <= 0.0)
        return 0.0;
    float logarithm;
    if (sine2 < 0.5) {
        // log(1 - sine2) / 2 as -artanh(z): its series has a small relative error near 0, unlike the built-in log
        float z = sine2 / (2.0 - sine2);
        float z2 = z * z;
        logarithm = -z * (1.0 + z2 * (1.0 / 3.0 + z2 * (0.2 + z2 * (1.0 / 7.0 + z2 * (1.0 / 9.0 + z2 / 11.0)))));
    } else {
        logarithm = log(c);
    }
    return exp(m * logarithm);
}

#if SPECULAR_MODEL != SPECULAR_MODEL_NONE
float highlight(vec3 n, vec3 to_light, vec3 to_eye, float n_dot_l, float shininess)
{
#if SPECULAR_MODEL == SPECULAR_MODEL_PHONG
    vec3 from = 2.0 * n_dot_l * n - to_light;  // reflected
    vec3 to = to_eye;
#else
    vec3 from = to_light + to_eye;             // half-way
    from *= inversesqrt(max(dot(from, from), 1e-30));
    vec3 to = n;
#endif
    vec3 across = cross(from, to);
    return power_of_cosine(dot(from, to), dot(across, across), shininess);
}
#endif
