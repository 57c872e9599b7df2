// scene_source: a frame of a scene as C++ source, for programs that have no files, as those of small computers.
//
//     scene_source NAME SCENE [options of wisp render] > NAME.cpp
//
// defines `extern const wisp::CompiledScene NAME` (compiled_scene.h). Its numbers are bit for bit those that `wisp`
// gives to the core.
#include "core/smoke/grid_samples.h"
#include "host/base/messages.h"
#include "host/commands/request.h"
#include "wisp/settings.h"
#include <cstdio>

namespace wisp {

namespace {

// Values as C++: doubles are hexadecimal, so that none is rounded.
std::string text(double x) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%a", x);
    return digits;
}
std::string text(bool x) { return x ? "true" : "false"; }
std::string text(int32_t x) { return std::to_string(x); }
std::string text(uint32_t x) { return std::to_string(x) + "u"; }
std::string text(uint64_t x) { return std::to_string(x) + "u"; }
std::string text(const std::string &x) { return x; } // C++ already
std::string text(const Double3 &v);
std::string text(const Camera &c);
template <class... Parts> std::string braces(const Parts &...parts) {
    std::string all;
    ((all += (all.empty() ? "{" : ", ") + text(parts)), ...);
    return all + "}";
}
template <class Enum> std::string choice(const char *type, Enum x) {
    return std::string("static_cast<") + type + ">(" + std::to_string(static_cast<int>(x)) + ")";
}
std::string text(const Double3 &v) { return braces(v.x, v.y, v.z); }
std::string triple(const Double3 v[3]) { return braces(v[0], v[1], v[2]); }

std::string text(const Particle &p) { return braces(p.position, p.h, p.area); }
std::string text(float x) { return text(static_cast<double>(x)) + "f"; }
std::string text(uint16_t x) { return std::to_string(x); }
std::string text(const Camera &c) { return braces(c.origin, c.corner, c.right, c.down); }
std::string text(const LightSource &l) {
    return braces(choice("LightKind", l.kind), l.position, l.direction, l.one_minus_cosine, l.color);
}
std::string text(const Material &m) {
    return braces(m.ambient, m.diffuse, m.specular, m.shininess, m.transmission, m.index);
}
std::string text(const Triangle &t) {
    const std::string texels = braces(braces(t.texel[0][0], t.texel[0][1]), braces(t.texel[1][0], t.texel[1][1]),
                                      braces(t.texel[2][0], t.texel[2][1]));
    return braces(triple(t.corner), triple(t.normal), texels, t.material, t.texture);
}
std::string text(const Instance &b) {
    return braces(b.first, b.count, triple(b.axis), b.origin, triple(b.inverse), b.visible, b.mirrored);
}

// Prints an array, and returns its name, for the pointer to it.
template <class T> std::string array(const char *type, const std::string &name, const T *values, uint64_t count) {
    if (count == 0) return "nullptr";
    std::printf("const %s %s[] = {", type, name.c_str());
    for (uint64_t i = 0; i < count; ++i)
        std::printf("%s%s", i % 8 == 0 ? "\n    " : " ", (text(values[i]) + ",").c_str());
    std::puts("\n};");
    return name;
}

void print_scene(const std::string &name, const std::string &title, const PreparedScene &prepared,
                 const Settings &s) {
    const Scene &scene = prepared.scene;
    std::vector<std::string> smokes, textures;
    for (uint32_t i = 0; i < scene.smoke_count; ++i) {
        const SmokeDescription &m = scene.smokes[i];
        const GridDescription &g = m.grid;
        const std::string number = std::to_string(i);
        const std::string particles = array("Particle", "particles_" + number, m.particles, m.count);
        const std::string density = array("float", "density_" + number, g.density, g.density ? stored_samples(g) : 0);
        const std::string blocks = array("uint32_t", "blocks_" + number, g.blocks, g.blocks ? block_places(g) : 0);
        const std::string grid = braces(g.nx, g.ny, g.nz, density, g.extinction, g.center, g.half, triple(g.axis),
                                        blocks, g.block_count,
                                        braces(g.skipped[0], g.skipped[1], g.skipped[2]));
        smokes.push_back(braces(particles, m.count, choice("Kernel", m.kernel), grid, m.smallest_h, m.largest_h,
                                m.total_area, m.albedo, m.asymmetry, m.emission));
    }
    for (uint32_t i = 0; i < scene.texture_count; ++i) {
        const Texture &t = scene.textures[i];
        uint64_t texels = 0;
        for (int32_t level = 0; level < t.levels; ++level)
            texels += uint64_t{3} * static_cast<uint64_t>(std::max(1, t.width >> level)) *
                      static_cast<uint64_t>(std::max(1, t.height >> level));
        textures.push_back(
            braces(t.width, t.height, t.levels, array("uint16_t", "texels_" + std::to_string(i), t.texels, texels)));
    }
    const std::string lights = array("LightSource", "lights", scene.lights, scene.light_count);
    const std::string smoke = array("SmokeDescription", "smokes", smokes.data(), smokes.size());
    const std::string triangles = array("Triangle", "triangles", scene.triangles, scene.triangle_count());
    const std::string instances = array("Instance", "instances", scene.instances, scene.instance_count);
    const std::string materials = array("Material", "materials", scene.materials, scene.material_count);
    const std::string pictures = array("Texture", "textures", textures.data(), textures.size());
    const std::string all = braces(
        scene.camera, scene.background, lights, scene.light_count, smoke, scene.smoke_count, scene.radiance_exponent,
        triangles, scene.static_count, scene.instance_triangle_count, scene.deforming_count, instances,
        scene.instance_count, materials, scene.material_count, pictures, scene.texture_count, scene.ray_epsilon);
    const std::string crop = braces(s.crop.x0, s.crop.y0, s.crop.x1, s.crop.y1, s.crop.step);
    const std::string settings =
        braces(crop, s.samples, s.depth, choice("ShadowMethod", s.shadows), s.check_shadows, s.photons, s.paths, s.seed,
               s.gather, s.gather_radius, s.step, choice("Deposit", s.deposit), choice("Direction", s.direction),
               choice("Estimate", s.estimate), s.density_step, s.light_step, choice("IrradianceMap", s.irradiance),
               s.irradiance_step, choice("Method", s.method), choice("LightChoice", s.lights),
               choice("TreeKind", s.tree), choice("Goal", s.goal), s.first_pass, s.last_pass);
    const std::string compiled = braces('"' + title + '"', prepared.width, prepared.height, all, settings);
    std::printf("} // namespace\nextern const CompiledScene %s;\nconst CompiledScene %s = %s;\n} // namespace wisp\n",
                name.c_str(), name.c_str(), compiled.c_str());
}

int run(const std::vector<std::string> &words) {
    if (words.size() < 2) throw Error(exit_usage, "expected scene_source NAME SCENE [options of wisp render]");
    const Request request =
        read_request(parse_arguments("scene_source", scene_options(), {words.begin() + 1, words.end()}));
    PreparedScene prepared;
    prepare_scene(request.name, request.file, request.options, request.frames.first, prepared);
    const Settings settings = settings_of(request.options, prepared);
    std::string title = request.name.substr(request.name.rfind('/') + 1);
    for (size_t i = 2; i < words.size(); ++i) title += ' ' + words[i];
    std::puts("#include \"portability/compiled_scene.h\"\nnamespace wisp {\nnamespace {");
    print_scene(words[0], title, prepared, settings);
    return exit_done;
}

} // namespace

} // namespace wisp

int main(int count, char **words) {
    try {
        return wisp::run({words + 1, words + count});
    } catch (const wisp::Error &error) {
        wisp::print_error(error, "scene_source");
        return error.status;
    }
}
