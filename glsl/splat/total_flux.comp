// total_flux: the flux that all facets send to each receiver.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

layout(local_size_x = SPLAT_GROUP) in;
FACET_IMAGES(0)
layout(std430, binding = 1) writeonly buffer Shares { ReceiverShare shares[]; };
layout(push_constant) uniform TotalPush {
    uint pair_count;
    uint receiver_count;
} push;

shared float values[SPLAT_GROUP];

// One workgroup a receiver. The order of the sum is fixed, so that equal input gives equal bits.
void main() {
    uint i = gl_LocalInvocationIndex;
    float sum = 0.0;
    for (uint pair = i; pair < push.pair_count; pair += SPLAT_GROUP) sum += facet_image_at(pair * push.receiver_count + gl_WorkGroupID.x).flux;
    values[i] = sum;
    barrier();
    for (uint stride = SPLAT_GROUP / 2; stride > 0; stride /= 2) {
        if (i < stride) values[i] += values[i + stride];
        barrier();
    }
    if (i == 0) shares[gl_WorkGroupID.x] = ReceiverShare(values[0], 0.0, 0.0, 0, 1);
}
