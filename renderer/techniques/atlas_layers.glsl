// How many layers of a surface lie over a texel.
out vec4 layers;
void main() { layers = vec4(1.0); }
