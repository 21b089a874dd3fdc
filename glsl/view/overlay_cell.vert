// overlay cell: environment cells on the sky, behind everything.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "gpu_types.glsl"

LIGHTS(0)
layout(location = 0) out vec2 place;        // in the cell, -1 to 1
layout(location = 1) out flat vec3 color;

#include "overlay.glsl"

void main() {
    // A cell is divided into CELL_PARTS x CELL_PARTS quads, since its sides are not straight.
    uint part = gl_VertexIndex / 6 % (CELL_PARTS * CELL_PARTS);
    uint corner = QUAD_CORNERS[gl_VertexIndex % 6];
    Light cell = light_at(push.first + gl_VertexIndex / (6 * CELL_PARTS * CELL_PARTS));
    vec2 at = vec2(part % CELL_PARTS, part / CELL_PARTS) + vec2(corner & 1, corner >> 1);
    place = 2.0 * at / float(CELL_PARTS) - 1.0;
    float azimuth = atan(cell.place.x, -cell.place.z) + place.x * cell.half_azimuth;
    float sine = clamp(cell.place.y + place.y * cell.half_sine, -1.0, 1.0);
    float cosine = sqrt(1.0 - sine * sine);
    color = push.is_sun != 0 ? vec3(1.0, 0.45, 0.0) : vec3(0.1, 0.9, 1.0);
    gl_Position = seen_at(push.eye + vec3(cosine * sin(azimuth), sine, -cosine * cos(azimuth)));
    gl_Position.z = 0.0;
}
