// Depth first: the shading passes then touch each pixel once.
void main() {}
