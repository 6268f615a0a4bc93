// The share of what comes through to the surface seen here that is left: lids, lips and ears stop some of it, for every technique.
#include "passes/lids.glsl"
in vec3 local; in vec4 a; in vec4 b;
layout(location = 0) out vec4 kept;
void main() { kept = vec4(through_flesh(local, a.x, b.w)); }
