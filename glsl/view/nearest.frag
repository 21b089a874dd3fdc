// nearest: writes only the depth.
#version 460

void main() {}
