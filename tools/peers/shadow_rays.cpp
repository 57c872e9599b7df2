// The shadow rays of an animation, resolved by each way of wisp, those without a ray included, and by Embree 3.
//
//   shadow_rays SCENE FRAMES [STEP]     every STEP-th of so many frames at 512 x 512, one ray a pixel
//
// The rays are those that shading asks for, in its order: from camera rays, and from reflected and refracted ones. They
// are kept as they are asked, then each way resolves all of a frame, with what it has learnt from the frames before,
// and Embree (RTC_SCENE_FLAG_ROBUST, rtcOccluded1, one thread) in a scene of what is opaque, whose making is not
// counted. What wisp makes for a frame is. `ratio` is Embree's time over a way's, with the widest vectors of the
// machine, and with isa=sse2.
#include "core/render/whitted.h"
#include "embree.h"
#include "wisp/settings.h"

namespace wisp::WISP_ARITH {
namespace {

// What shading asks for, and the answers of tracing.
struct Queries {
    Shadows traced;
    std::vector<ShadowQuery> queries;
    std::vector<bool> shadowed;
};
const ShadowTechnique recording_technique = {[](Shadows &shadows, const ShadowQuery &query) {
    Queries &all = memory_of<Queries>(shadows);
    all.queries.push_back(query);
    all.shadowed.push_back(is_shadowed(all.traced, query));
    return all.shadowed.back();
}};

using Bytes = std::vector<unsigned char>;

// A way of finding shadows, and what it keeps.
struct Way {
    const char *name;
    ShadowMethod method;
    Bytes kept, frame;
    void *memory = nullptr;
    double seconds = 0;
    uint64_t asked = 0, different = 0;
    Statistics statistics = {};
};

void measure(const std::string &name, int64_t frames, int64_t step) {
    Options options;
    options.width = options.height = pixels;
    options.frame_count = frames;
    const SceneFile file = read_scene(name);
    PreparedScene prepared;
    Way ways[] = {{"trace", ShadowMethod::trace, {}, {}}, {"exact", ShadowMethod::exact, {}, {}},
                  {"cache", ShadowMethod::cache, {}, {}}, {"lightbuffer", ShadowMethod::lightbuffer, {}, {}},
                  {"voxel", ShadowMethod::voxel, {}, {}}, {"lie", ShadowMethod::lie, {}, {}}};
    Bytes kept_trees, placed;
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
            kept_trees.resize(surface_bytes(scene));
            Arena arena(kept_trees.data(), kept_trees.size());
            surfaces = make_surfaces(scene, arena);
            for (Way &way : ways) {
                settings.shadows = way.method;
                way.kept.resize(shadow_bytes(scene, settings));
                way.frame.resize(way.kept.size());
                Arena own(way.kept.data(), way.kept.size());
                if (!make_shadow_memory(scene, settings, own, way.memory)) std::exit(1);
            }
        }
        placed.resize(placement_bytes(scene) + Arena::bytes<Light>(scene.light_count) +
                      Arena::bytes<SurfaceMaterial>(scene.material_count));
        Arena arena(placed.data(), placed.size());
        place_surfaces(scene, arena, surfaces);
        const Light *lights = make_lights(scene, arena);
        Statistics statistics;
        Queries kept = {{&scene, &surfaces, lights, &statistics}, {}, {}};
        Shadows recorder = {&scene, &surfaces, lights, &statistics, &recording_technique, &kept};
        const Whitted tracer = {&scene,
                                &surfaces,
                                make_surface_materials(scene, arena),
                                lights,
                                &recorder,
                                vec_of(scene.background),
                                10,
                                length(vec_of(scene.camera.down)),
                                &statistics};
        const View view(scene.camera);
        for (int y = 0; y < pixels; ++y)
            for (int x = 0; x < pixels; ++x) trace(tracer, view.ray_through(Real(x) + Real(0.5), Real(y) + Real(0.5)));
        for (Way &way : ways) {
            Shadows shadows = {&scene, &surfaces, lights, &way.statistics, find_technique(way.method), way.memory};
            settings.shadows = way.method;
            Arena own(way.frame.data(), way.frame.size());
            const double start = now();
            if (!begin_frame(shadows, settings, own)) std::exit(1);
            for (size_t i = 0; i < kept.queries.size(); ++i)
                way.different += is_shadowed(shadows, kept.queries[i]) != kept.shadowed[i];
            end_frame(shadows);
            way.seconds += now() - start;
            way.asked += kept.queries.size();
        }
        const Place place = place_of(scene);
        const char *devices[2] = {"threads=1,set_affinity=0", "threads=1,isa=sse2,set_affinity=0"};
        for (int d = 0; d < 2; ++d) {
            const Embree rival(opaque(place), place.ray_epsilon, devices[d]);
            const double start = now();
            for (size_t i = 0; i < kept.queries.size(); ++i) {
                const ShadowQuery &q = kept.queries[i];
                rival_different[d] += rival.occluded({q.ray.origin, q.ray.direction, q.end, 0}) != kept.shadowed[i];
            }
            rival_seconds[d] += now() - start;
        }
    }
    for (const Way &way : ways) {
        if (way.different > 0) {
            std::fprintf(stderr, "%s: %s: %llu shadows differ\n", name.c_str(), way.name,
                         static_cast<unsigned long long>(way.different));
            std::exit(1);
        }
        const double asked = static_cast<double>(way.asked);
        std::printf(WISP_ARITH_NAME ",%s,%s,%.3g,%.2f,%.2f,%.2f\n", name.substr(name.rfind('/') + 1).c_str(), way.name,
                    asked / way.seconds * 1e-6, ways[0].seconds / way.seconds, rival_seconds[0] / way.seconds,
                    rival_seconds[1] / way.seconds);
    }
    for (int d = 0; d < 2; ++d)
        std::printf(WISP_ARITH_NAME ",%s,%s,%.3g,%.2f,,%.3g%% differ\n", name.substr(name.rfind('/') + 1).c_str(),
                    d ? "Embree sse2" : "Embree", static_cast<double>(ways[0].asked) / rival_seconds[d] * 1e-6,
                    ways[0].seconds / rival_seconds[d],
                    100 * static_cast<double>(rival_different[d]) / static_cast<double>(ways[0].asked));
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
