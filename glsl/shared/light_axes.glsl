// The including shader includes light.glsl and optics.glsl.

// Root of the covariance of the light's directions, rad.
void light_axes(Light light, LightDisc disc, out vec3 a, out vec3 b) {
    a = light.axis1;
    b = light.axis2;
    if (light.is_lamp == 0) return;
    basis(disc.direction, a, b);
    a *= 0.5 * disc.angular_radius;
    b *= 0.5 * disc.angular_radius;
}
