// Mesh footprints: kernels on mesh receivers. A footprint is the part of the beam of a patch that meets one square of texels. The
// squares come from a quadtree, which is refined where the beam touches it as long as slots are free. The including shader includes
// trace.glsl and kernel_fit.glsl, and declares the receivers' buffers and `mesh_footprints`.

#include "light_beam.glsl"
#include "node_footprint.glsl"

// Squared support radius of the sharpest kernel.
const float MAX_SUPPORT = 2.0 * (SHARPEST + 2.0);

// Root of the covariance of the light's directions across the ray.
mat2 light_growth(Light light, LightDisc disc, vec3 n, float eta, mat2x3 across) {
    vec3 a, b;
    light_axes(light, disc, a, b);
    a = outgoing_change(disc.direction, n, a, vec3(0.0), eta);
    b = outgoing_change(disc.direction, n, b, vec3(0.0), eta);
    return mat2(a * across, b * across);
}

// Writes the footprints of a beam with `flux`, W, from `slot` on, and returns their number.
uint project_to_mesh(MeshReceiver receiver, LightBeam beam, vec3 flux, vec3 occluder, vec3 occluder_normal, uint slot) {
    uint count = touch_nodes(receiver, beam, MAX_SUPPORT);
    uint written = 0;
    for (uint i = 0; i < count; i++) {
        MeshFootprint footprint;
        if (project_to_node(receiver, unpacked(touched[i]), beam, flux, occluder, occluder_normal, footprint)) mesh_footprints[slot + written++] = footprint;
    }
    return written;
}

// Writes the footprints of a beam with `flux`, W, on all mesh receivers from `slot` on, and returns their number.
uint project_beam(LightBeam beam, vec3 flux, uint triangle, uint slot) {
    vec3 at = vec3(0.0);
    vec3 occluder_normal = vec3(0.0);
    if (push.can_occlude != 0) {
        Hit occluder = nearest(beam.start, beam.direction, triangle, OCCLUDES);
        if (occluder.triangle != NO_TRIANGLE) {
            at = beam.start + occluder.distance * beam.direction;
            occluder_normal = normal_against(triangle_at(occluder.triangle), beam.direction);
        }
    }
    uint count = 0;
    for (uint index = 0; index < push.receiver_count; index++) {
        count += project_to_mesh(mesh_receivers[index], beam, flux, at, occluder_normal, slot + count);
    }
    return count;
}
