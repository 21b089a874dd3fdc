// nearest: nothing but the depth.
#version 460

void main() {}
