// Where a surface is drawn.
#define SCREEN 0
#define ATLAS 1
#define POINTS 2
#ifndef DOMAIN
#define DOMAIN SCREEN
#endif
