// The share that lids, lips and ears leave of what comes through to a place, for techniques that reckon it themselves.
#include "passes/lids.glsl"
in vec3 local; in vec4 a; in vec4 b;
layout(location = 0) out vec4 kept;
void main() { kept = vec4(through_flesh(local, a.x, b.w)); }
