/* A scene in C: points in memory above a floor, a picture out.
 *
 *     cc -std=c99 scene.c $(pkg-config --cflags --libs wisp) -o scene
 *     ./scene scene.pfm
 *
 * The picture is that of `wisp render scene.aff`, bit for bit. */
#include <stdio.h>
#include <stdlib.h>
#include <wisp/c_api.h>

/* A ball of points as a simulation may have them: x, y and z in arrays of their own, in any order. */
static float points[3][123];

static uint64_t make_ball(void) {
    uint64_t count = 0;
    int x, y, z;
    for (z = 3; z >= -3; --z)
        for (y = -3; y <= 3; ++y)
            for (x = -3; x <= 3; ++x) {
                if (x * x + y * y + z * z > 9) continue;
                points[0][count] = (float)x, points[1][count] = (float)y, points[2][count] = (float)z;
                ++count;
            }
    return count;
}

static int print_progress(void *context, const char *stage, uint64_t done, uint64_t total) {
    static int last = -1;
    const int percent = total > 0 ? (int)(100 * done / total) : 0;
    (void)context;
    if (percent == last) return 0; /* it is called often */
    last = percent;
    fprintf(stderr, "\r%-13s %3d %%", stage, percent);
    return 0; /* another value would stop the work */
}

static int refuse(wisp_status status, const wisp_error *error) {
    fprintf(stderr, "scene: %s\n", error->text);
    return (int)status;
}

int main(int count, char **words) {
    const double floor_corners[] = {-8, -3, 8, 8, -3, 8, 8, -3, -8, -8, -3, -8};
    const uint32_t halves[] = {0, 1, 2, 0, 2, 3};
    const wisp_material grey = {.ambient = {0.5, 0.5, 0.5}, .diffuse = {0.5, 0.5, 0.5}};
    const wisp_mesh ground = {.triangle_count = 2, .indices = halves, .vertex_count = 4,
                              .positions = {.data = floor_corners, .number = WISP_FLOAT64}};
    const wisp_light lights[] = {{.kind = WISP_PARALLEL, .direction = {-0.6, -0.8, 0}, .color = {12, 11, 9}},
                                 {.kind = WISP_POINT, .position = {5, 1, 5}, .color = {20, 30, 60}}};
    const wisp_smoke ball = {.extinction = 1, .albedo = {0.9, 0.9, 0.9}, .phase = 0.5, .count = make_ball(),
                             .positions = {points, WISP_FLOAT32, sizeof points[0][0], sizeof points[0]},
                             .radius = 1, .mass = 1};
    const wisp_scene scene = {.version = WISP_C_API_VERSION, .width = 160, .height = 120,
                              .camera = {{0, 2, 14}, {0, -1, 0}, {0, 1, 0}, 40},
                              .background = {0.5, 0.6, 0.9}, .ambient = {0.25, 0.25, 0.25},
                              .lights = lights, .light_count = 2, .smokes = &ball, .smoke_count = 1,
                              .meshes = &ground, .mesh_count = 1, .materials = &grey, .material_count = 1};
    wisp_settings settings = wisp_default_settings();
    wisp_error error;
    wisp_frame *frame;
    wisp_plan plan;
    wisp_job job = {.progress = print_progress};
    wisp_status status;
    const size_t bytes = wisp_prepared_bytes(&scene);
    void *memory = malloc(bytes);
    char digest[65];
    FILE *file;
    uint32_t y;
    if (count != 2) return fputs("usage: scene PICTURE.pfm\n", stderr), 2;
    settings.photons = 40000;

    status = wisp_prepare(&scene, memory, bytes, &frame, &error);
    if (status == WISP_DONE) status = wisp_plan_frame(frame, &settings, &plan, &error);
    if (status != WISP_DONE) return refuse(status, &error);
    job.memory = malloc((size_t)plan.bytes);
    job.memory_bytes = (size_t)plan.bytes;
    job.rgb = malloc((size_t)3 * plan.width * plan.height * sizeof(float));
    if (!job.memory || !job.rgb) return fputs("scene: out of memory\n", stderr), 4;
    status = wisp_render(frame, &settings, &job, &error);
    fprintf(stderr, "\r%-19s\n", status == WISP_DONE ? "done" : "");
    if (status != WISP_DONE) return refuse(status, &error);

    wisp_digest(job.rgb, plan.width, plan.height, digest);
    printf("%s\n", digest);
    file = fopen(words[1], "wb");
    if (!file) return perror(words[1]), 5;
    fprintf(file, "PF\n%u %u\n-1.0\n", (unsigned)plan.width, (unsigned)plan.height); /* rows from the bottom */
    for (y = plan.height; y-- > 0;) fwrite(job.rgb + (size_t)3 * plan.width * y, 3 * sizeof(float), plan.width, file);
    if (ferror(file) | fclose(file)) return perror(words[1]), 5;
    free(job.rgb), free(job.memory), free(memory);
    return 0;
}
