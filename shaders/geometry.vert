#version 330 core
// Transforms an instance's vertices to view space. Matrices are computed in float64 and given as columns.
#ifndef ID  // the forward pass has neither of them
#define ID 0
#define VISIBILITY 0
#endif
#ifdef SORTED
#include "include/instance_table.glsl"
#endif
#include "include/lens.glsl"
#include "include/surface_maps.glsl"

in vec3 in_position;
in vec3 in_normal;
#if TEXCOORDS_1
in vec4 in_texcoord;  // both pairs: OpenGL guarantees 16 attributes, and all others are 16 at most
#else
in vec2 in_texcoord;
#endif
#if VERTEX_ALPHA
in vec4 in_color;
#elif VERTEX_COLOR
in vec3 in_color;
#endif
#if NORMAL_MAP && !BY_PYRENDER
in vec4 in_tangent;
#endif
#ifndef SORTED
in vec4 in_view_x;
in vec4 in_view_y;
in vec4 in_view_z;
#ifdef SCALED
in vec4 in_normal_x;  // the fourth ones are the colour scale
in vec4 in_normal_y;
in vec4 in_normal_z;
#else
in vec3 in_normal_x;
in vec3 in_normal_y;
in vec3 in_normal_z;
#endif
in vec4 in_base_color;
#if AMBIENT_ALBEDO
in vec3 in_ambient;
#endif
#if SPECULAR || defined(METALLIC)
in vec4 in_specular;  // of a metallic-roughness material: metalness, roughness
#endif
#if EMISSION
in vec3 in_emission;
#endif
#endif
#if ID
in uint in_id;
#endif
#if VISIBILITY || defined(NUMBERED)
uniform int u_first_instance;  // of this draw: index among all instances of the frame
#endif

invariant gl_Position;  // passes that draw the same geometry again must compute the same depth

out vec3 v_view;
out vec3 v_normal;
out vec2 v_texcoord;
#if VERTEX_COLOR
out vec3 v_color;
#endif
#if VERTEX_ALPHA
out float v_vertex_alpha;
#endif
flat out vec4 v_base_color;
#if AMBIENT_ALBEDO
flat out vec3 v_ambient;
#endif
#if SPECULAR || defined(METALLIC)
flat out vec4 v_specular;
#endif
#if NORMAL_MAP && !BY_PYRENDER
out vec4 v_tangent;
#endif
#if EMISSION
flat out vec3 v_emission;
#endif
#if TEXCOORDS_1
out vec2 v_texcoord_1;
#endif
#ifdef SCALED
flat out vec3 v_color_scale;
#endif
#if ID
flat out uint v_id;
#endif
#if VISIBILITY || defined(NUMBERED)
flat out uint v_instance;
#endif

void main()
{
#ifdef SORTED
    load_instance();
#endif
    vec4 p = vec4(in_position, 1.0);
    v_view = vec3(dot(p, in_view_x), dot(p, in_view_y), dot(p, in_view_z));
    v_normal = vec3(dot(in_normal, in_normal_x.xyz), dot(in_normal, in_normal_y.xyz), dot(in_normal, in_normal_z.xyz));
#if BY_PYRENDER || BY_PANDA3D
    v_normal *= inversesqrt(max(dot(v_normal, v_normal), 1e-37));  // they interpolate unit normals
#endif
#ifdef SCALED
    v_color_scale = vec3(in_normal_x.w, in_normal_y.w, in_normal_z.w);
#endif
    v_texcoord = in_texcoord.xy;
#if VERTEX_COLOR
    v_color = in_color.rgb;
#endif
#if VERTEX_ALPHA
    v_vertex_alpha = in_color.a;
#endif
    v_base_color = in_base_color;
#if AMBIENT_ALBEDO
    v_ambient = in_ambient;
#endif
#if SPECULAR || defined(METALLIC)
    v_specular = in_specular;
#endif
#if NORMAL_MAP && !BY_PYRENDER
    vec3 t = in_tangent.xyz;
    v_tangent = vec4(dot(t, in_view_x.xyz), dot(t, in_view_y.xyz), dot(t, in_view_z.xyz), in_tangent.w);
#endif
#if EMISSION
    v_emission = in_emission;
#endif
#if TEXCOORDS_1
    v_texcoord_1 = in_texcoord.zw;
#endif
#if ID
    v_id = in_id;
#endif
#if VISIBILITY || defined(NUMBERED)
    v_instance = uint(u_first_instance + gl_InstanceID + 1);
#endif
    gl_Position = view_to_clip(v_view);
}
