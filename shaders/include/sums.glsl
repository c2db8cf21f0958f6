// Provides the sums of many lights without the error of many roundings. For after shine.glsl.
// Up to 32 lights are added up, up to 32 such sums, and those: a sum of n rounds n times, this 97 times at 32,768. (A
// compensated sum would round less still, but compilers may take it apart where nothing forbids it in OpenGL 3.3.)

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
