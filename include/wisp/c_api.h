/* The library in C (C99), for programs in C and C++ and for other languages' foreign functions. It checks what it is
 * given. (wisp/wisp.h, for C++ alone, is below it: it checks nothing, and its scenes are in the core's own units.)
 *
 *     wisp_scene scene = {0};                       what to render, in units of your own; arrays stay where they are
 *     wisp_settings settings = wisp_default_settings();
 *     wisp_plan plan;                               how much memory it takes, and what for
 *     wisp_frame *frame;
 *     scene.version = WISP_C_API_VERSION; ...
 *     status = wisp_prepare(&scene, memory, wisp_prepared_bytes(&scene), &frame, &error);
 *     status = wisp_plan_frame(frame, &settings, &plan, &error);
 *     job.memory = block, job.memory_bytes = plan.bytes, job.rgb = picture;
 *     status = wisp_render(frame, &settings, &job, &error);
 *
 * The library takes no memory but what it is given, writes no file, keeps nothing, and has no state: threads may call
 * it at once, each with memory of its own. The same scene and settings give the same bits on every machine: those of
 * `wisp render` for the same numbers in a scene file.
 *
 * A wrong value is refused before any work, with a line in wisp_error that says where it is and what was expected.
 * There are no warnings, as `wisp render` has them of black or empty pictures. Numbers of scenes are finite and within
 * +-1e30. Lengths are in any unit; directions need not be of length 1; radiances are linear, R G B. A member that is
 * not mentioned may be 0. */
#ifndef WISP_C_API_H
#define WISP_C_API_H

#include <stddef.h>
#include <stdint.h>

#ifdef __GNUC__
#pragma GCC visibility push(default) /* what libwisp.so shows, and nothing else */
#endif
#ifdef __cplusplus
extern "C" {
#endif

/* Grows with every change of the structures below. A library takes structures of its own version only, and refuses
 * others with a line. */
#define WISP_C_API_VERSION 1
uint32_t wisp_c_api_version(void); /* of the library that is linked */
const char *wisp_version(void);    /* as `wisp version`: another may give other pictures */

typedef enum wisp_status {
    WISP_DONE = 0,
    WISP_STOPPED = 1,     /* by wisp_job::progress */
    WISP_WRONG_USAGE = 2, /* settings, or a call, as an option of `wisp` that is refused */
    WISP_BAD_SCENE = 3,   /* numbers of the scene */
    WISP_NO_MEMORY = 4    /* less memory than was asked for, or than can be addressed */
} wisp_status;

/* Why a call was refused, one line that ends in 0; empty where it was not. Where a function takes one, NULL is fine. */
typedef struct wisp_error {
    char text[256];
} wisp_error;

/* ---- The scene */

/* Numbers of the caller's, where they are: element i begins `stride` * i bytes after `data`. Its numbers, one or three
 * of them, are `step` bytes apart. Both may be below 0; 0: without gaps. Nothing needs to be aligned. */
typedef enum wisp_number { WISP_FLOAT32 = 0, WISP_FLOAT64 = 1 } wisp_number;
typedef struct wisp_array {
    const void *data; /* NULL: there is none */
    int32_t number;   /* wisp_number */
    int64_t stride, step;
} wisp_array;

/* As the statement `v`: `angle` in degrees, above 0, below 180, is from the centre of the top pixel row to the centre
 * of the bottom one. `up` may be any direction but that of the view. */
typedef struct wisp_camera {
    double from[3], at[3], up[3], angle;
} wisp_camera;

/* As the statements `lp`, `ls`, `ld` and `l`. */
typedef enum wisp_light_kind {
    WISP_POINT = 0,    /* radiant intensity `color`: irradiance falls off with the squared distance */
    WISP_SPOT = 1,     /* the same, inside a cone of `degrees` (whole angle, above 0, at most 360) about `direction` */
    WISP_PARALLEL = 2, /* irradiance `color`; `direction` is whither light travels */
    WISP_CONSTANT = 3  /* irradiance `color` from `position`, without falloff */
} wisp_light_kind;
typedef struct wisp_light {
    int32_t kind; /* wisp_light_kind */
    double position[3], direction[3], degrees;
    double color[3]; /* 0 or more */
} wisp_light;

/* As the block `smoke`. The extinction sigma_t is `extinction` times the density. */
typedef enum wisp_smoke_kind {
    WISP_PARTICLES = 0, /* density sum_i mass_i W(|x - x_i|, radius_i), whose support is two radii */
    WISP_GRID = 1,      /* `density` at the centres of cells[0] x cells[1] x cells[2] cells, x fastest; trilinear */
    WISP_BOX = 2        /* density 1 between `low` and `high` */
} wisp_smoke_kind;
typedef enum wisp_kernel { WISP_SPLINE = 0, WISP_POLY6 = 1 } wisp_kernel;
typedef struct wisp_smoke {
    int32_t kind;             /* wisp_smoke_kind */
    double extinction;        /* C_ext: area per mass; of grids and boxes per density and length; 0 or more */
    double albedo[3];         /* 0 to 1 */
    double phase;             /* g of Henyey and Greenstein, above -1, below 1 */
    double emission[3];       /* radiance L_e, 0 or more */
    uint64_t count;           /* of particles, below 2^32, in any order */
    wisp_array positions;     /* of particles: x y z */
    wisp_array radii, masses; /* of particles: smoothing lengths, above 0; masses, 0 or more */
    double radius, mass;      /* of all particles, where there is no such array */
    int32_t kernel;           /* wisp_kernel */
    uint32_t cells[3];        /* of a grid: 1 or more */
    wisp_array density;       /* of a grid: 0 or more */
    double low[3], high[3];   /* of a grid and a box: corners, low < high */
} wisp_smoke;

/* As the statement `fm`: Whitted's shading. */
typedef struct wisp_material {
    double ambient[3], diffuse[3], specular[3]; /* 0 or more; specular: Phong's, and the mirror's */
    double shininess;                           /* 0 or more */
    double transmission;                        /* weight of the transmitted ray, 0 to 1; above 0: casts no shadow */
    double index;                               /* of refraction, up to 1000; 0: 1 */
} wisp_material;

/* Triangles that move as one, or stand still. What is still, and the shapes of what moves, must not change from frame
 * to frame for wisp_cache to be of use. */
typedef enum wisp_motion {
    WISP_STILL = 0,    /* where its positions are */
    WISP_MOVING = 1,   /* at transform[0..2] x + transform[3..5] y + transform[6..8] z + transform[9..11] */
    WISP_DEFORMING = 2 /* where its positions are, which differ from frame to frame */
} wisp_motion;
typedef struct wisp_mesh {
    uint64_t triangle_count;
    const uint32_t *indices; /* 3 vertices a triangle; NULL: 0 1 2, 3 4 5, ... */
    uint64_t vertex_count;
    wisp_array positions; /* of vertices: x y z */
    wisp_array normals;   /* of vertices: x y z, of any length; none, or 0 0 0: that of the plane */
    uint32_t material;    /* which of the scene's */
    int32_t motion;       /* wisp_motion */
    double transform[12]; /* of WISP_MOVING; without an inverse: it is not there */
} wisp_mesh;

typedef struct wisp_scene {
    uint32_t version;       /* WISP_C_API_VERSION */
    uint32_t width, height; /* pixels, 1 to 65536 */
    wisp_camera camera;
    double background[3]; /* what a ray sees that meets nothing; it lights nothing; 0 or more */
    double ambient[3];    /* light that materials' `ambient` is multiplied by; 0 or more */
    const wisp_light *lights;
    uint32_t light_count;
    const wisp_smoke *smokes;
    uint32_t smoke_count;
    const wisp_mesh *meshes;
    uint32_t mesh_count;
    const wisp_material *materials;
    uint32_t material_count;
} wisp_scene;

/* A scene that is ready to render, in the caller's memory. The arrays of the scene are not needed any more. */
typedef struct wisp_frame wisp_frame;

/* The bytes that wisp_prepare() takes; 0 for a scene that it refuses for its pointers and counts. */
size_t wisp_prepared_bytes(const wisp_scene *scene);

/* Reads the scene, checks it, and makes *frame in `memory` of `bytes`, of any alignment, which must outlive it. Smoke
 * that reaches beyond 8192 of its smallest radii from its middle, or from that of the meshes, is refused, as are
 * surfaces that move beyond four times of what stands still. WISP_DONE, WISP_WRONG_USAGE, WISP_BAD_SCENE or
 * WISP_NO_MEMORY. */
wisp_status wisp_prepare(const wisp_scene *scene, void *memory, size_t bytes, wisp_frame **frame, wisp_error *error);

/* ---- How it is rendered */

typedef enum wisp_arithmetic { WISP_F32 = 0, WISP_F64 = 1, WISP_FIXED = 2 } wisp_arithmetic;

/* Words of the options, which `wisp render --help` explains. */
typedef enum wisp_method { WISP_METHOD_DIRECT, WISP_METHOD_MAP, WISP_METHOD_VOLUME } wisp_method;
typedef enum wisp_irradiance {
    WISP_IRRADIANCE_NONE,
    WISP_IRRADIANCE_UNIFORM,
    WISP_IRRADIANCE_ADAPTIVE
} wisp_irradiance;
typedef enum wisp_estimate { WISP_ESTIMATE_KERNEL, WISP_ESTIMATE_KNN } wisp_estimate;
typedef enum wisp_deposit {
    WISP_DEPOSIT_EXACT,
    WISP_DEPOSIT_PATH,
    WISP_DEPOSIT_KERNEL,
    WISP_DEPOSIT_NODES
} wisp_deposit;
typedef enum wisp_direction { WISP_DIRECTION_FLUX, WISP_DIRECTION_MEAN } wisp_direction;
typedef enum wisp_light_choice { WISP_LIGHTS_ALL, WISP_LIGHTS_CUTS } wisp_light_choice;
typedef enum wisp_tree { WISP_TREE_BOX, WISP_TREE_KD } wisp_tree;
typedef enum wisp_shadows {
    WISP_SHADOWS_TRACE,
    WISP_SHADOWS_CACHE,
    WISP_SHADOWS_PAPER,
    WISP_SHADOWS_EXACT,
    WISP_SHADOWS_VOXEL,
    WISP_SHADOWS_LIGHTBUFFER,
    WISP_SHADOWS_LIE
} wisp_shadows;

/* The options of `wisp render`. Steps are in smoothing lengths; of grids, in the shortest edge of a cell; of boxes, in
 * a twentieth of their shortest edge. */
typedef struct wisp_settings {
    uint32_t version;       /* WISP_C_API_VERSION */
    int32_t arithmetic;     /* wisp_arithmetic: --arith (WISP_F32) */
    uint32_t crop[4];       /* --crop: x0 y0 x1 y1, half-open; all 0: the whole picture */
    uint32_t samples;       /* --spp: rays a pixel, 1 to 65536 (4) */
    uint64_t seed;          /* --seed (1) */
    uint64_t photons;       /* --photons, below 2^63 (1,000,000) */
    int32_t method;         /* --smoke: wisp_method (map) */
    int32_t irradiance;     /* --irradiance: wisp_irradiance (uniform) */
    int32_t estimate;       /* --estimate: wisp_estimate (kernel) */
    int32_t deposit;        /* --deposit: wisp_deposit (nodes) */
    int32_t direction;      /* --direction: wisp_direction (flux) */
    uint32_t gather;        /* --gather, 2 to 1,000,000 (500) */
    double gather_radius;   /* --gather-radius, above 0, to 1000 (2) */
    double step;            /* --step, 0.0001 to 1000 (1) */
    double density_step;    /* --density-step: 0, or 0.01 to 1000 (0.5) */
    double light_step;      /* --light-step: 0, or 0.01 to 1000 (0.5) */
    double irradiance_step; /* --irradiance-step, 0.01 to 1000 (1) */
    uint32_t paths;         /* random paths from each ray in place of photons; 0: photons (0) */
    uint32_t depth;         /* --depth, to 64 (10) */
    int32_t shadows;        /* --shadows: wisp_shadows (exact) */
    int32_t lights;         /* --lights: wisp_light_choice (all) */
    int32_t tree;           /* --tree: wisp_tree (box) */
    int32_t layers;         /* --layers: 1 fills wisp_job::layers (0) */
} wisp_settings;

/* Those in parentheses. They are what `wisp render` chooses but for the four steps, which it fits to the smoke. */
wisp_settings wisp_default_settings(void);

/* Chooses what is left open as `wisp render` does, to fit the smoke: method, irradiance, estimate, deposit and the four
 * steps, where they are below 0; and `paths`. It takes memory of its own, so it is in the shared library, libwisp.so,
 * alone. WISP_DONE, WISP_WRONG_USAGE or WISP_NO_MEMORY. */
wisp_status wisp_choose_settings(const wisp_frame *frame, wisp_settings *settings, wisp_error *error);

/* ---- The plan */

#define WISP_MOST_STAGES 32
#define WISP_MOST_LAYERS 16
typedef struct wisp_stage {
    const char *name, *room; /* as `wisp plan` prints it; the folder below src/core that has its code */
    const char *reason;      /* why it is needed, or why not */
    int32_t needed;
    uint64_t bytes; /* at most */
} wisp_stage;
typedef struct wisp_layer {
    const char *name;
    uint32_t channels; /* 1, or 3: one plane each */
} wisp_layer;
typedef struct wisp_plan {
    uint64_t bytes;         /* that wisp_job::memory needs */
    uint32_t width, height; /* of the picture: of the crop */
    uint32_t stage_count, layer_count, plane_count;
    wisp_stage stages[WISP_MOST_STAGES];
    wisp_layer layers[WISP_MOST_LAYERS]; /* in the order of their planes; none without wisp_settings::layers */
} wisp_plan;

/* Says what the frame needs, and renders nothing. Refuses what wisp_render() refuses of settings and scene. */
wisp_status wisp_plan_frame(const wisp_frame *frame, const wisp_settings *settings, wisp_plan *plan, wisp_error *error);

/* ---- The picture */

/* What is kept from frame to frame: trees of still triangles, what was proved of shadows, smoke that is the same with
 * its optical depths. All 0 at first, then the library's own: hand it to each frame of a sequence, with the same memory
 * and the same number of bytes. What does not fit the frame is made anew, so pictures are the same without it. */
typedef struct wisp_cache {
    uint64_t words[8];
} wisp_cache;

/* Exact counters, the same on every machine: those of `wisp render --stats`. */
#define WISP_MOST_COUNTERS 64
typedef struct wisp_counter {
    const char *group, *name; /* "rays", "primary" */
    uint64_t value;
} wisp_counter;
typedef struct wisp_statistics {
    uint32_t count;
    wisp_counter counters[WISP_MOST_COUNTERS];
} wisp_statistics;

typedef struct wisp_job {
    void *memory; /* of any alignment; its contents do not matter */
    size_t memory_bytes;
    float *rgb;                  /* width * height pixels of the plan, R G B, top row first */
    float *layers;               /* plane_count planes of width * height; NULL without wisp_settings::layers */
    wisp_cache *cache;           /* NULL: nothing is kept */
    wisp_statistics *statistics; /* NULL: none are wanted */
    /* Is called as each stage begins (done = 0), and as parts of it are done. Another value than 0 stops the work.
     * NULL: it is not called. */
    int (*progress)(void *context, const char *stage, uint64_t done, uint64_t total);
    void *context;
} wisp_job;

/* Renders. Unless it returns WISP_DONE the picture is of no use; after a refusal it is not touched. */
wisp_status wisp_render(const wisp_frame *frame, const wisp_settings *settings, const wisp_job *job, wisp_error *error);

/* The SHA-256 of the picture as .pfm, as `wisp render --digest` prints it: 64 digits and a 0. A picture that is NULL or
 * larger than 1,000,000 pixels on a side has an empty one. */
void wisp_digest(const float *rgb, uint32_t width, uint32_t height, char digest[65]);

#ifdef __cplusplus
}
#endif
#ifdef __GNUC__
#pragma GCC visibility pop
#endif

#endif
