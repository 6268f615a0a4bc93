/* The yardstick of photons.py: a plain single-thread loop after the description of MCML (Wang, Jacques and Zheng 1995,
   doi:10.1016/0169-2607(95)01640-F), with log, cos and sqrt where the paper has them, written for this benchmark alone.

   usage: mcml PHOTONS SEED N_ABOVE N_BELOW  [N MU_A MU_S G D]...      (mm; D may be inf)
   prints: wall_s cpu_s specular diffuse_reflectance transmittance absorbed */

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define LAYERS 16
#define RADII 120
#define ANGLES 90

static uint64_t s0, s1;

static double uniform(void) /* xorshift128+, in (0, 1) */
{
    uint64_t a = s0, b = s1;
    s0 = b;
    a ^= a << 23;
    s1 = a ^ b ^ (a >> 17) ^ (b >> 26);
    return (((s1 + b) >> 11) + 0.5) * 0x1p-53;
}

static double fresnel(double n1, double n2, double cos1, double *cos2)
{
    double sin2 = n1 / n2 * sqrt(1 - cos1 * cos1);
    if (sin2 >= 1) { *cos2 = 0; return 1; }
    *cos2 = sqrt(1 - sin2 * sin2);
    double s = (n1 * cos1 - n2 * *cos2) / (n1 * cos1 + n2 * *cos2);
    double p = (n2 * cos1 - n1 * *cos2) / (n2 * cos1 + n1 * *cos2);
    return 0.5 * (s * s + p * p);
}

static double seconds(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

int main(int argc, char **argv)
{
    static double n[LAYERS + 2], mu_a[LAYERS + 2], mu_t[LAYERS + 2], g[LAYERS + 2], z[LAYERS + 2];
    static double radial[2][RADII + 1], angular[2][ANGLES + 1], absorbed[LAYERS + 2];
    if (argc < 10 || (argc - 5) % 5 || (argc - 5) / 5 > LAYERS) return 2;
    long photons = atol(argv[1]);
    s0 = 0x9E3779B97F4A7C15u * (strtoull(argv[2], 0, 10) + 1);
    s1 = 0xBF58476D1CE4E5B9u ^ s0;
    int layers = (argc - 5) / 5;
    double reach = 0;
    n[0] = atof(argv[3]);
    n[layers + 1] = atof(argv[4]);
    for (int i = 1; i <= layers; i++) {
        char **v = argv + 5 * i;
        n[i] = atof(v[0]), mu_a[i] = atof(v[1]), mu_t[i] = mu_a[i] + atof(v[2]), g[i] = atof(v[3]);
        z[i] = z[i - 1] + atof(v[4]);
        reach = fmax(reach, 100 / mu_t[i]);
    }
    double wall = seconds(CLOCK_MONOTONIC), cpu = seconds(CLOCK_PROCESS_CPUTIME_ID);
    double cos2, specular = fresnel(n[0], n[1], 1, &cos2), pi = acos(-1);
    for (long photon = 0; photon < photons; photon++) {
        double x = 0, y = 0, depth = 0, ux = 0, uy = 0, uz = 1, w = 1 - specular, left = 0;
        int i = 1;
        for (;;) {
            if (left == 0) left = -log(uniform());
            double step = left / mu_t[i];
            double face = uz > 0 ? z[i] : z[i - 1];
            double to_face = uz != 0 ? (face - depth) / uz : INFINITY;
            if (to_face < step) {
                left -= to_face * mu_t[i];
                x += ux * to_face, y += uy * to_face, depth = face;
                int next = uz > 0 ? i + 1 : i - 1;
                double f = n[i] == n[next] ? (cos2 = fabs(uz), 0) : fresnel(n[i], n[next], fabs(uz), &cos2);
                if (uniform() < f) { uz = -uz; continue; }
                if (next == 0 || next == layers + 1) {
                    int below = next != 0, ir = sqrt(x * x + y * y) / reach * RADII, ia = acos(cos2) / (pi / 2) * ANGLES;
                    radial[below][ir < RADII ? ir : RADII] += w;
                    angular[below][ia] += w;
                    break;
                }
                ux *= n[i] / n[next], uy *= n[i] / n[next], uz = copysign(cos2, uz);
                i = next;
                continue;
            }
            x += ux * step, y += uy * step, depth += uz * step, left = 0;
            double dw = w * mu_a[i] / mu_t[i];
            w -= dw;
            absorbed[i] += dw;
            double cost = g[i] == 0 ? 2 * uniform() - 1 : (1 - g[i] * g[i]) / (1 - g[i] + 2 * g[i] * uniform());
            if (g[i] != 0) cost = (1 + g[i] * g[i] - cost * cost) / (2 * g[i]);
            double sint = sqrt(1 - cost * cost), psi = 2 * pi * uniform(), cosp = cos(psi);
            double sinp = psi < pi ? sqrt(1 - cosp * cosp) : -sqrt(1 - cosp * cosp);
            if (fabs(uz) > 1 - 1e-12) {
                ux = sint * cosp, uy = sint * sinp, uz = copysign(cost, uz * cost);
            } else {
                double t = sqrt(1 - uz * uz), vx = sint * (ux * uz * cosp - uy * sinp) / t + ux * cost;
                double vy = sint * (uy * uz * cosp + ux * sinp) / t + uy * cost;
                uz = -sint * cosp * t + uz * cost, ux = vx, uy = vy;
            }
            if (w < 1e-4) {
                if (w == 0 || uniform() > 0.1) break;
                w *= 10;
            }
        }
    }
    wall = seconds(CLOCK_MONOTONIC) - wall, cpu = seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu;
    double R = 0, T = 0, A = 0, shown = 0;
    for (int i = 0; i <= RADII; i++) R += radial[0][i], T += radial[1][i];
    for (int i = 0; i <= ANGLES; i++) shown += angular[0][i] + angular[1][i]; /* so that no compiler leaves it out */
    for (int i = 1; i <= layers; i++) A += absorbed[i];
    if (fabs(shown - R - T) > 1e-6 * photons) return 1;
    printf("%.6f %.6f %.6f %.6f %.6f %.6f\n", wall, cpu, specular, R / photons, T / photons, A / photons);
    return 0;
}
