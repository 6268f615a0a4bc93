// Depth along the layer's axis; interpolated in the world, so that cones keep it linear.
in float depth_mm;
uniform float depth_range;
void main() { gl_FragDepth = depth_mm / depth_range; }
