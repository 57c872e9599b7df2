#include "host/base/error.h"
#include "host/commands/commands.h"
#include "host/commands/request.h"
#include "host/prepare/particle_report.h"
#include "host/results/fingerprint.h"
#include "wisp/settings.h"
#include <cstdio>

namespace wisp {

namespace {

void print_stage(const char *name, bool needed, uint64_t bytes, const std::string &why) {
    std::printf("%-14s %-4s %14llu bytes  %s\n", name, needed ? "yes" : "no", static_cast<unsigned long long>(bytes),
                why.c_str());
}

// What a scene of triangles needs.
void print_surface_stages(const Request &request, const Scene &scene, const Plan &plan) {
    const auto number = [](uint64_t n) { return std::to_string(n); };
    uint64_t visible = 0;
    for (uint32_t i = 0; i < scene.instance_count; ++i) visible += scene.instances[i].visible;
    bool mirrors = false, passes = false;
    for (uint32_t i = 0; i < scene.material_count; ++i) {
        const Material &m = scene.materials[i];
        mirrors |= m.specular.x > 0 || m.specular.y > 0 || m.specular.z > 0;
        passes |= m.transmission > 0;
    }
    uint64_t texels = 0;
    for (uint32_t i = 0; i < scene.texture_count; ++i)
        texels += static_cast<uint64_t>(scene.textures[i].width) * static_cast<uint64_t>(scene.textures[i].height);
    print_stage("triangle trees", true, plan.bytes.triangle_trees,
                number(scene.static_count) + " triangles in one tree, built once" +
                    (scene.instance_count
                         ? "; " + number(scene.instance_triangle_count) + " in those of " + number(scene.instance_count) +
                               " bodies (" + number(visible) + " visible), built once and placed in each frame"
                         : "") +
                    (scene.deforming_count ? "; " + number(scene.deforming_count) + " in one for each frame" : ""));
    print_stage("textures", scene.texture_count > 0, 0,
                scene.texture_count ? number(scene.texture_count) + " of " + number(texels) + " texels" : "none");
    print_stage("shadows", scene.light_count > 0, plan.bytes.shadows,
                scene.light_count ? std::string(shadow_method_descriptions[static_cast<size_t>(request.options.shadows)]) + ", " + number(scene.light_count) + " lights"
                                  : "there is no light");
    if (request.options.lights == LightChoice::cuts)
        print_stage("light cuts", scene.light_count > 1, plan.bytes.light_cuts,
                    scene.light_count > 1 ? "a tree of the lights; rays to clusters that err by less than 2 %"
                                          : "of no use: there are not several lights");
    print_stage("recursion", (mirrors || passes) && request.options.depth > 0, 0,
                !mirrors && !passes ? "nothing mirrors or lets light through"
                                    : std::string(mirrors ? "reflected" : "") + (mirrors && passes ? " and " : "") +
                                          (passes ? "refracted" : "") + " rays, at most " +
                                          number(request.options.depth) + " in a chain");
}

void print_notes(const Options &options, const PreparedScene &prepared) {
    if (!options.verbose) return;
    for (const std::string &note : prepared.notes) std::printf("%s\n", note.c_str());
}

} // namespace

int plan_command(const std::vector<std::string> &arguments) {
    const Request request = read_request(parse_arguments("plan", scene_options(), arguments));
    check_options(request);
    PreparedScene prepared;
    prepare_scene(request.name, request.file, request.options, request.frames.first, prepared);
    const Settings settings = settings_of(request.options, prepared);
    const Plan plan = checked_plan(request, prepared.scene, settings);
    check_picture(request, settings, plan);
    const Options &options = request.options;
    if (!options.map_in.empty())
        saved_map(request, request.frames.first,
                  fingerprint_of_map(prepared.scene, settings, core(options.arithmetic).name), plan);

    const auto print_arena = [&] {
        print_stage("arena", true, plan.bytes.arena, std::string("all of it, in ") + core(options.arithmetic).name);
        print_stage("picture", !options.batches, picture_bytes(options, settings),
                    std::to_string(settings.crop.x1 - settings.crop.x0) + " x " +
                        std::to_string(settings.crop.y1 - settings.crop.y0) + " pixels, beside the arena");
        print_notes(options, prepared);
    };
    if (plan.surfaces) print_surface_stages(request, prepared.scene, plan);
    if (plan.surfaces && !plan.smoke) {
        print_stage("smoke", false, 0, "there is none: no particle tree, photon or march");
        print_arena();
        return exit_done;
    }
    uint64_t particles = 0;
    for (const auto &smoke : prepared.particles) particles += smoke.size();
    bool black = true;
    for (const SmokeDescription &smoke : prepared.smokes)
        if (smoke.albedo.x > 0 || smoke.albedo.y > 0 || smoke.albedo.z > 0) black = false;
    const std::string why_no_photons = !plan.smoke             ? "there is no smoke"
                                       : black                 ? "the albedo is 0: nothing scatters"
                                       : settings.photons == 0 ? "--photons 0"
                                                               : "nothing lights the smoke";
    uint64_t samples = 0;
    for (const SmokeDescription &smoke : prepared.smokes) samples += smoke.grid.count();
    const std::string density = (particles ? std::to_string(particles) + " particles" : std::string()) +
                                (particles && samples ? ", " : "") +
                                (samples ? std::to_string(samples) + " samples of grids" : std::string());
    if (plan.bricks > 0)
        print_stage("bricks", true, plan.bytes.particle_tree,
                    density + " resampled to " + std::to_string(plan.bricks) + " bricks of 8 x 8 x 8 cells");
    else
        print_stage("particle tree", plan.smoke, plan.bytes.particle_tree,
                    plan.smoke ? density : "there are no particles");
    if (settings.reference) {
        print_stage("majorants", plan.smoke,
                    plan.bytes.arena - plan.bytes.particle_tree - plan.bytes.triangle_trees - plan.bytes.shadows -
                        plan.bytes.light_cuts,
                    plan.smoke ? "bounds of the density, for free paths" : "there is no smoke");
        print_stage("paths", true, 0,
                    std::to_string(uint64_t{settings.last_pass - settings.first_pass} * settings.samples) + " a pixel");
    } else if (settings.method == Method::map) {
        std::string origin = " photons to emit";
        if (options.batches) {
            const auto &[first, last] = *options.batches;
            origin += ", of them batches " + std::to_string(first) + ":" + std::to_string(last);
        }
        if (!options.map_in.empty()) origin = " photons of " + numbered(options.map_in, request.frames.first);
        const std::string where = plan.bricks > 0 ? ", kept at the bricks' nodes: " : ", kept on the particles: ";
        const std::string packed = plan.bricks > 0          ? ""
                                   : plan.photon_directions ? ": packed to 8 bytes each"
                                                            : ": packed to 4 bytes each";
        print_stage("particle map", plan.photons, plan.bytes.particle_map,
                    !plan.photons ? why_no_photons
                                  : std::to_string(settings.photons) + origin + where +
                                        (plan.photon_powers ? "power in R G B" : "one power (all are equal)") +
                                        (!plan.photon_directions                 ? ", no flux (isotropic)"
                                         : settings.direction == Direction::mean ? ", mean direction"
                                         : plan.photon_harmonics                   ? ", flux and moments of directions"
                                                                                 : ", flux") +
                                        packed);
        if (settings.estimate == Estimate::knn)
            print_stage("gather", plan.photons, plan.bytes.gather,
                        plan.photons ? "up to " + std::to_string(settings.gather) + " nearest particles"
                                     : "there are no photons");
        else if (plan.bricks == 0)
            print_stage("sources", plan.smoke, plan.bytes.sources,
                        plan.smoke ? "what each sends to the eye" : "there is no smoke");
    } else {
        print_stage("photons", plan.photons, plan.bytes.photon_map,
                    !plan.photons ? why_no_photons
                                  : std::to_string(settings.photons) + " to emit, at most " +
                                        std::to_string(plan.photon_capacity) + " stored: positions" +
                                        (plan.photon_directions ? ", directions" : ", no directions (isotropic)") +
                                        (plan.photon_powers ? ", powers" : ", no powers (all are equal)"));
        print_stage("gather", plan.photons, plan.bytes.gather,
                    plan.photons ? "up to " + std::to_string(settings.gather) + " nearest photons"
                                 : "there are no photons");
    }
    if (!settings.reference) {
        const bool irradiance = settings.irradiance != IrradianceMap::none;
        print_stage("irradiance", plan.bytes.irradiance > 0, plan.bytes.irradiance,
                    plan.bytes.irradiance > 0 ? "at most, and what making it takes; bricks around smoke"
                    : irradiance              ? "nothing scatters twice"
                                              : "--irradiance none: estimated at every step");
        print_stage("light depths", plan.bytes.light_depths > 0, plan.bytes.light_depths,
                    plan.bytes.light_depths > 0 ? "at most; around smoke"
                    : settings.light_step > 0   ? "no light is scattered by any smoke"
                                                : "--light-step 0: every depth is found exactly");
        print_stage("march", plan.smoke, 0,
                    !plan.smoke     ? "rays see the background alone"
                    : plan.surfaces ? "all rays through the smoke, up to what they hit"
                                    : "camera rays through the smoke");
    }
    if (options.lights == LightChoice::cuts && !plan.surfaces)
        print_stage("light cuts", false, 0, "of no use: there is no surface");
    print_arena();
    if (request.options.verbose)
        for (const std::string &line : particle_report(prepared, core(request.options.arithmetic)))
            std::printf("%s\n", line.c_str());
    return exit_done;
}

} // namespace wisp
