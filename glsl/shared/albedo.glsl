// Albedo of diffuse surfaces.

vec3 albedo_of(Object object) {
    return object.color;
}
