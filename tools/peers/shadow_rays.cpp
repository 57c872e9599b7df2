// The shadow queries of an animation, answered by each technique of wisp and by Embree 3.
//
//   shadow_rays SCENE FRAMES [STEP]     every STEP-th of so many frames at 512 x 512, one ray a pixel
//
// The queries are those of shading, in its order: from camera rays, and from reflected and refracted ones. They are
// recorded. Then each technique answers all queries of a frame, with what it has learnt in the frames before. So does
// Embree (RTC_SCENE_FLAG_ROBUST, rtcOccluded1, one thread) in a scene of the opaque triangles. Building Embree's scene
// is not timed; what a technique makes for a frame is. `over Embree` is Embree's time over a technique's, with the
// widest vectors of the machine, and with isa=sse2.
#include "core/render/whitted.h"
#include "embree.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {
namespace {

// The queries of shading, and the answers of tracing.
struct Queries {
    Shadows traced;
    std::vector<ShadowQuery> queries;
    std::vector<bool> shadowed;
};
const ShadowTechnique recording_technique = {[](Shadows &shadows, const ShadowQuery &query) {
    Queries &all = memory_of<Queries>(shadows);
    all.queries.push_back(query);
    const bool shadowed = is_shadowed(all.traced, query);
    all.shadowed.push_back(shadowed);
    return shadowed;
}};

using Bytes = std::vector<unsigned char>;

// A technique that is measured, and its memory.
struct Technique {
    const char *name;
    ShadowMethod method;
    Bytes sequence_bytes, frame_bytes; // what lives through the sequence, and through a frame
    void *memory = nullptr;
    double seconds = 0;
    uint64_t queries = 0, different = 0;
    Statistics statistics = {};
};

void measure(const std::string &name, int64_t frames, int64_t step) {
    Options options;
    options.width = options.height = pixels;
    options.frame_count = frames;
    const SceneFile file = read_scene(name);
    PreparedScene prepared;
    Technique techniques[] = {
        {"trace", ShadowMethod::trace, {}, {}}, {"exact", ShadowMethod::exact, {}, {}},
        {"cache", ShadowMethod::cache, {}, {}}, {"lightbuffer", ShadowMethod::lightbuffer, {}, {}},
        {"voxel", ShadowMethod::voxel, {}, {}}, {"lie", ShadowMethod::lie, {}, {}}};
    Bytes tree_bytes, placement;
    Surfaces surfaces;
    double rival_seconds[2] = {0, 0};
    uint64_t rival_different[2] = {0, 0};
    for (int64_t f = 0; f < frames; f += step) {
        prepare_scene(name, file, options, f, prepared);
        const Scene &scene = prepared.scene;
        Settings settings = {};
        settings.crop = {0, 0, pixels, pixels};
        settings.samples = 1;
        if (f == 0) {
            tree_bytes.resize(surface_bytes(scene, TreeKind::bvh));
            Arena arena(tree_bytes.data(), tree_bytes.size());
            surfaces = make_surfaces(scene, TreeKind::bvh, arena);
            for (Technique &technique : techniques) {
                settings.shadows = technique.method;
                technique.sequence_bytes.resize(shadow_bytes(scene, settings));
                technique.frame_bytes.resize(technique.sequence_bytes.size());
                Arena own(technique.sequence_bytes.data(), technique.sequence_bytes.size());
                if (!make_shadow_memory(scene, settings, own, technique.memory)) std::exit(1);
            }
        }
        constexpr uint32_t depth = 10;
        placement.resize(placement_bytes(scene, TreeKind::bvh) + Arena::bytes<Light>(scene.light_count) +
                         Arena::bytes<SurfaceMaterial>(scene.material_count) + ray_level_bytes(depth));
        Arena arena(placement.data(), placement.size());
        place_surfaces(scene, arena, surfaces);
        const Light *lights = make_lights(scene, arena);
        Statistics statistics;
        Queries recorded = {{&scene, &surfaces, lights, &statistics}, {}, {}};
        Shadows recorder = {&scene, &surfaces, lights, &statistics, &recording_technique, &recorded};
        const Whitted tracer = {&scene,
                                &surfaces,
                                make_surface_materials(scene, arena),
                                lights,
                                &recorder,
                                vec_of(scene.background),
                                depth,
                                length(vec_of(scene.camera.down)),
                                &statistics,
                                arena.make<RayLevel>(depth + 1)};
        const View view(scene.camera);
        for (int y = 0; y < pixels; ++y)
            for (int x = 0; x < pixels; ++x) trace(tracer, view.ray_through(Real(x) + Real(0.5), Real(y) + Real(0.5)));
        for (Technique &technique : techniques) {
            Shadows shadows = {
                &scene, &surfaces, lights, &technique.statistics, find_technique(technique.method), technique.memory};
            settings.shadows = technique.method;
            Arena own(technique.frame_bytes.data(), technique.frame_bytes.size());
            const double start = now();
            if (!begin_frame(shadows, settings, own)) std::exit(1);
            for (size_t i = 0; i < recorded.queries.size(); ++i)
                technique.different += is_shadowed(shadows, recorded.queries[i]) != recorded.shadowed[i];
            end_frame(shadows);
            technique.seconds += now() - start;
            technique.queries += recorded.queries.size();
        }
        const FlatScene flat = flatten(scene);
        const char *devices[2] = {"threads=1,set_affinity=0", "threads=1,isa=sse2,set_affinity=0"};
        for (int d = 0; d < 2; ++d) {
            const Embree rival(opaque(flat), flat.ray_epsilon, devices[d]);
            const double start = now();
            for (size_t i = 0; i < recorded.queries.size(); ++i) {
                const ShadowQuery &q = recorded.queries[i];
                rival_different[d] += rival.occluded({q.ray.origin, q.ray.direction, q.end, 0}) != recorded.shadowed[i];
            }
            rival_seconds[d] += now() - start;
        }
    }
    for (const Technique &technique : techniques) {
        if (technique.different > 0) {
            std::fprintf(stderr, "%s: %s: %llu shadows differ\n", name.c_str(), technique.name,
                         static_cast<unsigned long long>(technique.different));
            std::exit(1);
        }
        const double queries = static_cast<double>(technique.queries);
        std::printf(WISP_ARITH_NAME ",%s,%s,%.3g,%.2f,%.2f,%.2f\n", name.substr(name.rfind('/') + 1).c_str(),
                    technique.name, queries / technique.seconds * 1e-6, techniques[0].seconds / technique.seconds,
                    rival_seconds[0] / technique.seconds, rival_seconds[1] / technique.seconds);
    }
    for (int d = 0; d < 2; ++d)
        std::printf(WISP_ARITH_NAME ",%s,%s,%.3g,%.2f,,%.3g%% differ\n", name.substr(name.rfind('/') + 1).c_str(),
                    d ? "Embree sse2" : "Embree", static_cast<double>(techniques[0].queries) / rival_seconds[d] * 1e-6,
                    techniques[0].seconds / rival_seconds[d],
                    100 * static_cast<double>(rival_different[d]) / static_cast<double>(techniques[0].queries));
}

} // namespace
} // namespace wisp::WISP_ARITH

int main(int count, char **words) {
    using namespace wisp;
    if (count < 3) return 2;
    std::printf("arithmetic,scene,way,million a second,over trace,over Embree,over Embree sse2\n");
    try {
        wisp::WISP_ARITH::measure(words[1], std::stoll(words[2]), count > 3 ? std::stoll(words[3]) : 1);
    } catch (const Error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
