// A texture, texel by texel, from a row on.
uniform sampler2D source;
uniform int first_row;
out vec4 colour;
void main() { colour = texelFetch(source, ivec2(gl_FragCoord.xy) + ivec2(0, first_row), 0); }
