// overlay count: counts the splats that a texel of the light maps gets.
#version 460

layout(location = 0) out vec4 result;

void main() {
    result = vec4(1.0);
}
