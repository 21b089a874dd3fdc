// visible: the number of the nearest triangle.
#version 460

layout(location = 0) in flat uint number;
layout(location = 0) out uint result;

void main() {
    result = number;
}
