// Provides sums of many lights with few roundings. Include it after shine.glsl.
// Up to 32 lights are added, then up to 32 of these sums, then the sums of those. A plain sum of n lights is rounded n
// times, this one 97 times for 32,768 lights. (A compensated sum would be more accurate, but OpenGL 3.3 cannot forbid a
// compiler to simplify it away.)

vec3 radiance_carried = vec3(0.0);
vec3 radiance_all = vec3(0.0);
vec3 light_carried = vec3(0.0);
vec3 light_all = vec3(0.0);

void carry_sums()
{
    radiance_carried += radiance_sum;
    light_carried += light_sum;
    radiance_sum = light_sum = vec3(0.0);
}

void carry_carried()
{
    radiance_all += radiance_carried;
    light_all += light_carried;
    radiance_carried = light_carried = vec3(0.0);
}

void close_sums()
{
    radiance_sum = radiance_all + radiance_carried;
    light_sum = light_all + light_carried;
}
