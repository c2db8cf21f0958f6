// Provides add_light, which adds what one light does to a surface to radiance_sum and light_sum.
// What one light adds ends at LARGEST_LIGHT: infinity times an albedo of 0 would be no number.
// light_sum is what a white surface without highlights would show. At half the resolution highlights
// are kept apart: radiance is theirs. GLOSS: Phong highlights are added to gloss_sum instead of radiance_sum.
// PANDA3D: highlights are Blinn-Phong ones, on surfaces that face away as well, and see the eye infinitely far behind the
// camera; LOCAL_VIEWER: where it is; LOCAL_VIEWERS: where the surface says.
#include "include/phong.glsl"
#ifdef METALLIC_ROUGHNESS
#include "include/metallic.glsl"
#endif

#if PARTICLE_SHADOW
#define STRENGTH vec3  // particles may absorb each colour channel differently
#else
#define STRENGTH float
#endif

const float LARGEST_LIGHT = 1e30;

vec3 radiance_sum = vec3(0.0);
vec3 light_sum = vec3(0.0);
#ifdef GLOSS
vec3 gloss_sum = vec3(0.0);
#endif

#if (defined(PYRENDER) && defined(METALLIC_ROUGHNESS)) || defined(LOCAL_VIEWER) || defined(LOCAL_VIEWERS)
// Unit vector to the camera's position, where the rays of an orthographic camera meet as well.
vec3 way_to_camera(Surface s)
{
#if ORTHOGRAPHIC
    vec3 place = place_of(s);
    return place * -inversesqrt(max(dot(place, place), 1e-30));
#else
    return way_to_eye(s);
#endif
}
#endif

vec3 way_of_highlights(Surface s)
{
#ifdef PANDA3D
#if defined(LOCAL_VIEWERS)
    return s.local ? way_to_camera(s) : vec3(0.0, -1.0, 0.0);
#elif defined(LOCAL_VIEWER)
    return way_to_camera(s);
#else
    return vec3(0.0, -1.0, 0.0);
#endif
#else
    return way_to_eye(s);
#endif
}

void add_light(Surface s, vec3 to_light, float n_dot_l, STRENGTH strength, vec3 color, vec3 specular_color)
{
#if defined(PYRENDER) || defined(PANDA3D)
    vec3 diffuse = color * max(n_dot_l, 0.0);
#else
    vec3 diffuse = color * n_dot_l;
#endif
#if CLAMP_LIGHT
    diffuse = min(diffuse, 1.0);
#endif
    diffuse = min(diffuse * strength, LARGEST_LIGHT);
#if defined(METALLIC_ROUGHNESS) && RADIANCE
    if (s.metallic.x >= 0.0) {
#ifdef PYRENDER
        n_dot_l = max(n_dot_l, GRAZING);
        vec3 base_light = min(color * n_dot_l * strength, LARGEST_LIGHT);
        vec3 to_eye = way_to_camera(s);
#else
        vec3 base_light = diffuse;
        vec3 to_eye = way_to_eye(s);
#endif
        vec3 passed;
        vec3 share = n_dot_l * reflected(head_on(s.albedo, s.metallic.x), s.metallic.y, s.normal, to_light, to_eye,
                                         n_dot_l, passed);
        vec3 glint = color * share;
#if CLAMP_LIGHT
        glint = min(glint, 1.0);
#endif
        radiance_sum += min(glint * strength, LARGEST_LIGHT);
#if LIGHT_RESOLUTION == LIGHT_RESOLUTION_FULL
        light_sum += diffuse;
        radiance_sum += diffuse_color(s.albedo, s.metallic.x) * passed * base_light;
#else
        light_sum += passed * diffuse;  // the upsampling pass multiplies it by the colour
#endif
        return;
    }
#endif
    light_sum += diffuse;
#if RADIANCE
#if LIGHT_RESOLUTION == LIGHT_RESOLUTION_FULL
    radiance_sum += s.albedo * diffuse;
#endif
#if SPECULAR_MODEL != SPECULAR_MODEL_NONE
    vec3 shine = s.specular.rgb * specular_color
        * highlight(s.normal, to_light, way_of_highlights(s), n_dot_l, s.specular.a);
#if CLAMP_LIGHT
    shine = min(shine, 1.0);
#endif
#ifdef GLOSS
    gloss_sum += min(shine * strength, LARGEST_LIGHT);
#else
    radiance_sum += min(shine * strength, LARGEST_LIGHT);
#endif
#endif
#endif
}
