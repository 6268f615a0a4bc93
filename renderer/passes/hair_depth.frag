// Depth of the first strand from a lamp.
in float depth_mm;
uniform float depth_range;
void main() { gl_FragDepth = depth_mm / depth_range; }
