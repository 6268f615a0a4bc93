// The base samples measure contrast; the rest are taken only where it is high.
#include "shaders/burley_disc.glsl"
#include "shaders/contrast.glsl"
