// Scales a tone-mapped picture to the size of the window, with bilinear filtering.
#version 460

layout(set = 0, binding = 0) uniform sampler2D picture;

layout(push_constant) uniform Push {
    // Pixels of the window.
    vec2 size;
};

layout(location = 0) out vec4 color;

void main() {
    color = textureLod(picture, gl_FragCoord.xy / size, 0.0);
}
