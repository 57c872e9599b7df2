/* Single scattering in a density grid by the plainest marcher: for each step of a camera's ray a march to the light. No
   depths are kept, no cell is skipped, nothing is vectorised by hand. wisp is measured against it (grid_single of make
   bench).

     marcher VOL OUT.pfm SIDE STEP LIGHT_STEP      steps in cells

   The scene is that of single_g05.pfm: camera at (0, 1, 4.5), 30 degrees between the outer edges of SIDE x SIDE pixels of
   2 x 2 rays; extinction 60 times the density, albedo 0.9, Henyey and Greenstein's g = 0.5, a point light of intensity 10
   at (1.5, 2.5, 1.5). Samples lie at the centres of cells, and outer halves of cells are constant. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct {
    float x, y, z;
} Vec;
static Vec add_scaled(Vec a, Vec d, float t) { return (Vec){a.x + d.x * t, a.y + d.y * t, a.z + d.z * t}; }
static float length_of(Vec v) { return sqrtf(v.x * v.x + v.y * v.y + v.z * v.z); }
static Vec scaled(Vec v, float s) { return (Vec){v.x * s, v.y * s, v.z * s}; }

static int n[3];
static float low[3], high[3], cells_per_unit, *density;

static float clamped(float x, float most) { return x < 0 ? 0 : x > most ? most : x; }

/* In the box only. */
static float extinction(Vec p) {
    const float x = clamped((p.x - low[0]) * cells_per_unit - 0.5f, n[0] - 1.001f);
    const float y = clamped((p.y - low[1]) * cells_per_unit - 0.5f, n[1] - 1.001f);
    const float z = clamped((p.z - low[2]) * cells_per_unit - 0.5f, n[2] - 1.001f);
    const int i = (int)x, j = (int)y, k = (int)z;
    const float u = x - i, v = y - j, w = z - k;
    const float *at = density + (k * n[1] + j) * n[0] + i, *up = at + n[0], *far = at + n[0] * n[1], *both = far + n[0];
    const float a = (at[0] + u * (at[1] - at[0])) * (1 - v) + (up[0] + u * (up[1] - up[0])) * v;
    const float b = (far[0] + u * (far[1] - far[0])) * (1 - v) + (both[0] + u * (both[1] - both[0])) * v;
    return 60 * (a + w * (b - a));
}

/* The part of a ray in the box; 0: none. */
static int clip(Vec from, Vec d, float *begin, float *end) {
    const float o[3] = {from.x, from.y, from.z}, dir[3] = {d.x, d.y, d.z};
    for (int axis = 0; axis < 3; ++axis) {
        float a = (low[axis] - o[axis]) / dir[axis], b = (high[axis] - o[axis]) / dir[axis];
        if (a > b) {
            const float c = a;
            a = b, b = c;
        }
        if (a > *begin) *begin = a;
        if (b < *end) *end = b;
    }
    return *begin < *end;
}

static float optical_depth(Vec from, Vec d, float end, float step) {
    float begin = 0, sum = 0;
    if (!clip(from, d, &begin, &end)) return 0;
    const int steps = (int)((end - begin) / step) + 1;
    const float dt = (end - begin) / steps;
    for (int i = 0; i < steps; ++i) sum += extinction(add_scaled(from, d, begin + (i + 0.5f) * dt));
    return sum * dt;
}

static float radiance(Vec eye, Vec d, float step, float light_step) {
    const Vec light = {1.5f, 2.5f, 1.5f};
    float begin = 0, end = 1e9f, depth = 0, sum = 0;
    if (!clip(eye, d, &begin, &end)) return 0;
    const int steps = (int)((end - begin) / step) + 1;
    const float dt = (end - begin) / steps;
    for (int i = 0; i < steps; ++i) {
        const Vec p = add_scaled(eye, d, begin + (i + 0.5f) * dt);
        const float sigma = extinction(p), s = sigma * dt;
        if (sigma == 0) continue;
        const Vec way = add_scaled(light, p, -1);
        const float r = length_of(way), g = 0.5f;
        const Vec to = scaled(way, 1 / r);
        const float cosine = to.x * d.x + to.y * d.y + to.z * d.z, q = 1 + g * g - 2 * g * cosine;
        /* light travels along -to, and leaves along -d */
        const float phase = (1 - g * g) / (4 * 3.14159265f * q * sqrtf(q));
        const float arriving = 10 / (r * r) * expf(-optical_depth(p, to, r, light_step));
        sum += expf(-depth) * (1 - expf(-s)) * 0.9f * phase * arriving;
        depth += s;
    }
    return sum;
}

int main(int count, char **words) {
    if (count != 6) return fprintf(stderr, "marcher VOL OUT.pfm SIDE STEP LIGHT_STEP\n"), 2;
    FILE *file = fopen(words[1], "rb");
    unsigned char head[48];
    if (!file || fread(head, 48, 1, file) != 1 || memcmp(head, "VOL\3\1\0\0\0", 8) != 0)
        return fprintf(stderr, "marcher: %s: expected VOL version 3 with float32\n", words[1]), 3;
    memcpy(n, head + 8, 12), memcpy(low, head + 24, 12), memcpy(high, head + 36, 12);
    const size_t samples = (size_t)n[0] * (size_t)n[1] * (size_t)n[2];
    density = malloc(samples * sizeof(float));
    if (!density || fread(density, sizeof(float), samples, file) != samples)
        return fprintf(stderr, "marcher: %s: expected %zu samples\n", words[1], samples), 3;
    fclose(file);
    cells_per_unit = n[0] / (high[0] - low[0]);
    const int side = atoi(words[3]);
    const float step = (float)atof(words[4]) / cells_per_unit, light_step = (float)atof(words[5]) / cells_per_unit;
    float *picture = side > 0 ? calloc((size_t)side * (size_t)side * 3, sizeof(float)) : NULL;
    if (!picture) return fprintf(stderr, "marcher: no picture of %s pixels\n", words[3]), 2;
    const Vec eye = {0, 1, 4.5f};
    const float half = tanf(15 * 3.14159265f / 180);
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            float sum = 0;
            for (int ray = 0; ray < 4; ++ray) {
                const float u = (x + 0.25f + 0.5f * (ray & 1)) / side * 2 - 1, v = (y + 0.25f + 0.5f * (ray >> 1)) / side * 2 - 1;
                const Vec d = {u * half, v * half, -1};
                sum += radiance(eye, scaled(d, 1 / length_of(d)), step, light_step);
            }
            for (int c = 0; c < 3; ++c) picture[(y * side + x) * 3 + c] = 0.25f * sum; /* rows from the bottom */
        }
    FILE *out = fopen(words[2], "wb");
    if (!out) return fprintf(stderr, "marcher: %s: cannot be written\n", words[2]), 5;
    fprintf(out, "PF\n%d %d\n-1.0\n", side, side);
    fwrite(picture, sizeof(float), (size_t)side * (size_t)side * 3, out);
    return fclose(out) == 0 ? 0 : 5;
}
