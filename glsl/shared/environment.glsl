// Radiance from infinity. The including shader declares the sampler `environment`, whose mip
// levels are averages over solid angle, and calls with the rotation in rad.

vec3 environment_radiance(vec3 direction, float rotation, float level) {
    float u = (atan(direction.x, -direction.z) - rotation) / (2.0 * PI);
    float v = acos(clamp(direction.y, -1.0, 1.0)) / PI;
    return textureLod(environment, vec2(u, v), level).rgb;
}

// Mip level whose texels are as high as `angle`, rad.
float environment_level(float angle) {
    return log2(max(angle * float(textureSize(environment, 0).y) / PI, 1.0));
}
