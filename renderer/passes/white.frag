// One, for counting what is drawn.
out vec4 colour;
void main() { colour = vec4(1.0); }
