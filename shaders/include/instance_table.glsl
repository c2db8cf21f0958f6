// Provides load_instance, and what it fills: the values of a vertex's instance, which are otherwise attributes. A draw
// whose triangles are sorted mixes instances, and OpenGL hands attributes to whole instances only.
// A row of the table is an instance: firefly_sample/gpu/instance_rows.py

in uint in_instance;  // of this draw's
uniform sampler2D u_instances;
uniform int u_first_instance;  // of this draw, in the table

const int INSTANCE_TEXELS = 10;
const int ROW = 256;  // instances in a row of texels

vec4 in_view_x, in_view_y, in_view_z;
vec4 in_normal_x, in_normal_y, in_normal_z;  // the fourth ones are the colour scale, with SCALED
vec4 in_base_color;
vec3 in_ambient;
vec4 in_specular;
vec3 in_emission;

void load_instance()
{
    int number = u_first_instance + int(in_instance);
    ivec2 at = ivec2(INSTANCE_TEXELS * (number & (ROW - 1)), number / ROW);
    in_view_x = texelFetch(u_instances, at, 0);
    in_view_y = texelFetch(u_instances, at + ivec2(1, 0), 0);
    in_view_z = texelFetch(u_instances, at + ivec2(2, 0), 0);
    in_normal_x = texelFetch(u_instances, at + ivec2(3, 0), 0);
    in_normal_y = texelFetch(u_instances, at + ivec2(4, 0), 0);
    in_normal_z = texelFetch(u_instances, at + ivec2(5, 0), 0);
    in_base_color = texelFetch(u_instances, at + ivec2(6, 0), 0);
    in_ambient = texelFetch(u_instances, at + ivec2(7, 0), 0).xyz;
    in_specular = texelFetch(u_instances, at + ivec2(8, 0), 0);
    in_emission = texelFetch(u_instances, at + ivec2(9, 0), 0).xyz;
}
