in float depth_mm;
layout(location = 0) out float linear_depth;
void main() { linear_depth = depth_mm; }
