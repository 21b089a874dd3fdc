// chain footprint: expands the footprints of landings of chains into quads along the rows and columns of texels, or along the axes of
// narrow ellipses. Vertex 4 i + c is corner c of footprint i.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"
#include "quad.glsl"
#include "kernel.glsl"

layout(std430, binding = 0) readonly buffer Footprints { ChainFootprint footprints[]; };
layout(location = 0) out flat vec4 conic_and_flatness;
layout(location = 1) out flat vec4 irradiance_and_kernel;
layout(location = 2) out flat vec4 sides;
layout(location = 3) out flat vec4 centre_slant;
layout(location = 4) out flat float share;
layout(location = 5) out flat vec4 bounds; // low and high, texels

// Area of the rectangle of rows and columns over that of the quad along the ellipse's axes from which on the latter is drawn.
const float MIN_GAIN = 1.5;
// Ellipses that are longer for their width have no accurate axes in 32 bits.
const float LARGEST_ASPECT = 500.0;
// By which a turned quad is wider than the ellipse, relative and in texels: for what rounding loses.
const float WIDER = 1.05;
const float MARGIN = 0.05;

// Corner of the quad around a footprint for this vertex. A narrow ellipse that lies across rows and columns fills little of their rectangle.
// Light is where d^T C d <= (1 + s.d)^2, with d from the centre, C the conic and s the slant: where (d - c)^T M (d - c) <= 1 + s.c, with
// M = C - s s^T and c = M^-1 s.
vec2 corner_of(ChainFootprint footprint, vec2 slant) {
    vec2 along_rows = quad_corner(footprint.lower, footprint.upper);
    vec3 m = footprint.conic - outer2(slant);
    float determinant = m.x * m.z - m.y * m.y;
    float trace = m.x + m.z;
    if (footprint.share > 0.0 || !(determinant * LARGEST_ASPECT * LARGEST_ASPECT > trace * trace)) return along_rows;
    vec2 c = vec2(m.z * slant.x - m.y * slant.y, m.x * slant.y - m.y * slant.x) / determinant;
    float square = 1.0 + dot(slant, c);
    float difference = length(vec2(m.x - m.z, 2.0 * m.y));
    float larger = 0.5 * (trace + difference);
    vec2 reach = sqrt(square * vec2(larger / determinant, 1.0 / larger)) * WIDER + MARGIN;
    vec2 box = footprint.upper - footprint.lower;
    if (!(4.0 * MIN_GAIN * reach.x * reach.y < box.x * box.y)) return along_rows;
    // Unit vector across the longer axis, by half of twice its angle.
    float cosine = (m.x - m.z) / difference;
    vec2 across = vec2(sqrt(max(0.5 + 0.5 * cosine, 0.0)), sqrt(max(0.5 - 0.5 * cosine, 0.0)) * (m.y < 0.0 ? -1.0 : 1.0));
    vec2 side = quad_corner(vec2(-1.0), vec2(1.0));
    return footprint.centre + c + side.x * reach.x * vec2(-across.y, across.x) + side.y * reach.y * across;
}

void main() {
    ChainFootprint footprint = footprints[gl_VertexIndex / 4];
    conic_and_flatness = vec4(footprint.conic, footprint.flatness);
    irradiance_and_kernel = vec4(footprint.irradiance, footprint.kernel);
    sides = footprint.sides;
    centre_slant = vec4(footprint.centre, unpackHalf2x16(footprint.slant));
    share = footprint.share;
    bounds = vec4(footprint.lower, footprint.upper);
    gl_Position = clip_position(corner_of(footprint, centre_slant.zw));
}
