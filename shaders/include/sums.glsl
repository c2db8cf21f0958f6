// Provides carry_sums and close_sums: sums of many lights without the error of many roundings. For after shine.glsl.
// Up to 32 lights are added up, 32 such sums, and those: a sum of n rounds n times, this 96 times at 32,768. (A
// compensated sum would round less still, but compilers may take it apart where nothing forbids it in OpenGL 3.3.)

vec3 radiance_carried = vec3(0.0);
vec3 radiance_all = vec3(0.0);
vec3 light_carried = vec3(0.0);
vec3 light_all = vec3(0.0);

void carry_sums(int word)
{
    radiance_carried += radiance_sum;
    light_carried += light_sum;
    radiance_sum = light_sum = vec3(0.0);
    // a loop of one turn, which drivers on a CPU leave out, where an if is computed and thrown away
    for (bool full = (word & 31) == 31; full; full = false) {
        radiance_all += radiance_carried;
        light_all += light_carried;
        radiance_carried = light_carried = vec3(0.0);
    }
}

void close_sums()
{
    radiance_sum = radiance_all + radiance_carried;
    light_sum = light_all + light_carried;
}
