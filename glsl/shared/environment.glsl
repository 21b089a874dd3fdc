// Radiance of the environment. The including shader declares the sampler `environment`, whose mip levels are averages
// over solid angle. `rotation` is in rad, 0 to 2 pi.

vec3 environment_radiance(vec3 direction, float rotation, float level) {
    // At the poles every azimuth is correct, but atan(0, 0) is undefined.
    float azimuth = direction.x == 0.0 && direction.z == 0.0 ? 0.0 : atan(direction.x, -direction.z);
    float u = (azimuth - rotation) / (2.0 * PI);
    float v = acos(clamp(direction.y, -1.0, 1.0)) / PI;
    return textureLod(environment, vec2(u, v), level).rgb;
}

// Mip level whose texels have the height `angle`, rad.
float environment_level(float angle) {
    return log2(max(angle * float(textureSize(environment, 0).y) / PI, 1.0));
}
