#include "host/prepare/chosen_scene.h"
#include "core/smoke/grid_samples.h"
#include "host/base/double3_algebra.h"
#include "host/base/error.h"
#include "host/base/files.h"
#include "host/base/text.h"
#include "host/formats/particles.h"
#include "host/formats/volume.h"
#include "host/prepare/core_units.h"
#include "host/scene/placement.h"
#include <algorithm>
#include <filesystem>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

namespace wisp {

namespace {

// More samples of a sparse grid than these stand together, block by block: memory and time stay small.
constexpr size_t max_single_samples = size_t{1} << 23;

// The smoke of one file: its particles, or the samples of its grid that are above 0, or its blocks.
struct Cloud {
    std::vector<Double3> points;
    std::vector<double> areas;  // extinction cross-sections for an extinction of 1; empty: 1 each
    std::vector<double> radius; // smoothing lengths in the file; empty: none
    double reach = 0;           // of a sample or block of a grid; 0: of particles
    bool has_mass = false;

    double area(size_t i) const { return areas.empty() ? 1 : areas[i]; }
};

Cloud cloud_of(const Volume &volume) {
    Cloud cloud;
    double edge[3], volume_of_cell = 1;
    const uint32_t count[3] = {volume.nx, volume.ny, volume.nz};
    for (size_t a = 0; a < 3; ++a) {
        edge[a] = (volume.high[a] - volume.low[a]) / count[a];
        volume_of_cell *= edge[a];
    }
    GridDescription grid = {};
    volume.describe_samples(grid);
    const bool by_block = grid.blocks && volume.density.size() > max_single_samples;
    cloud.reach = std::max({edge[0], edge[1], edge[2]}) * (by_block ? block_edge : 1);
    const auto add = [&](double x, double y, double z, double density) {
        cloud.points.push_back(volume.axis[0] * (volume.low[0] + x * edge[0]) +
                               volume.axis[1] * (volume.low[1] + y * edge[1]) +
                               volume.axis[2] * (volume.low[2] + z * edge[2]));
        cloud.areas.push_back(density * volume_of_cell);
    };
    if (by_block)
        for_each_block(grid, [&](const int32_t(&low)[3], const float *samples) {
            constexpr double middle = 0.5 * block_edge;
            const double sum = std::accumulate(samples, samples + samples_of_block, 0.0);
            if (sum > 0) add(low[0] + middle, low[1] + middle, low[2] + middle, sum);
            return true;
        });
    else
        for_each_run(grid, [&](int32_t x, int32_t y, int32_t z, const float *densities, int32_t n) {
            for (int32_t i = 0; i < n; ++i)
                if (densities[i] > 0) add(x + i + 0.5, y + 0.5, z + 0.5, static_cast<double>(densities[i]));
            return true;
        });
    return cloud;
}

Cloud read_cloud(const std::string &path, const std::string &grid) {
    const Bytes bytes = read_file(path);
    if (is_volume(bytes.data(), bytes.size())) return cloud_of(parse_volume(path, bytes.data(), bytes.size(), grid));
    Particles table = parse_particles(path, bytes.data(), bytes.size());
    Cloud cloud;
    for (const auto &p : table.position) cloud.points.push_back({p[0], p[1], p[2]});
    for (const Double3 &p : cloud.points)
        if (!(largest_component(p) <= 1e30))
            throw InputError(path,
                             "a particle is outside +-1e30, expected all within, or a scene that says what to show");
    cloud.has_mass = !table.mass.empty();
    cloud.areas = std::move(table.mass);
    cloud.radius = std::move(table.smoothing_length);
    return cloud;
}

// ---- Sequences

struct Sequence {
    int64_t first = 0, step = 1, count = 1;
    std::string left_out; // which files are no frames, and why; empty: none
    int64_t number(int64_t frame) const { return first + frame * step; }
};

// The numbers of the files of a numbered name that are there, from the lowest on, as far as they are evenly spaced.
Sequence find_sequence(const std::string &pattern) {
    if (!has_number(pattern)) return {};
    const std::vector<int64_t> numbers = numbers_of_files(pattern);
    if (numbers.empty()) throw InputError(pattern, "no file has a name like this, expected some with numbers in it");
    Sequence sequence;
    sequence.first = numbers[0];
    if (numbers.size() > 1) sequence.step = numbers[1] - numbers[0];
    const int64_t files = static_cast<int64_t>(numbers.size());
    while (sequence.count < files && numbers[static_cast<size_t>(sequence.count)] == sequence.number(sequence.count))
        ++sequence.count;
    if (sequence.count < files)
        sequence.left_out = "no file has number " + std::to_string(sequence.number(sequence.count)) + ": the " +
                            std::to_string(sequence.count) + " before it are the frames, and those from " +
                            std::to_string(numbers[static_cast<size_t>(sequence.count)]) + " on are left out";
    return sequence;
}

// ---- Extents

// The axes of the picture, of length 1: `back` points to the eye.
struct Axes {
    Double3 right, up, back;
};
struct Extent {
    double low = 1e300, high = -1e300;
    double size() const { return high - low; }
    double middle() const { return 0.5 * (low + high); }
    void include(const Extent &other) { low = std::min(low, other.low), high = std::max(high, other.high); }
};

// Where the points lie along an axis. Strays are left out: where the outermost thousandth on either side makes the
// extent more than twice as long, it does not count.
Extent extent_along(const std::vector<Double3> &points, const Double3 &axis) {
    std::vector<double> at;
    for (const Double3 &p : points) at.push_back(dot(p, axis));
    const auto [low, high] = std::minmax_element(at.begin(), at.end());
    const Extent all = {*low, *high};
    const size_t outermost = at.size() / 1000;
    if (outermost == 0) return all;
    const auto nth = [&](size_t n) {
        std::nth_element(at.begin(), at.begin() + static_cast<ptrdiff_t>(n), at.end());
        return at[n];
    };
    const Extent most = {nth(outermost), nth(at.size() - 1 - outermost)};
    const double margin = 0.1 * most.size();
    return all.size() > 2 * most.size() && most.size() > 0 ? Extent{most.low - margin, most.high + margin} : all;
}

// ---- The smoke's numbers

// The distance between neighbouring points: the edge of a cube for each, in a volume that is found by counting cubes of
// twice that edge that hold points. It is found for points on a surface or a line, too. All points lie in a cube of
// their longest extent, which bounds it: fewer than eight points may lie in one cube of any size.
double spacing_of(const std::vector<Double3> &points) {
    Double3 low = points[0], high = points[0];
    for (const Double3 &p : points) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const double count = static_cast<double>(points.size()), longest = largest(high - low);
    if (!(longest > 0)) return 0;
    const double widest = longest / cbrt(count);
    double spacing = widest;
    std::vector<uint64_t> cubes;
    for (int round = 0; round < 30; ++round) {
        const double edge = std::max(2 * spacing, longest * 0x1p-20);
        cubes.clear();
        for (const Double3 &p : points) {
            const auto along = [edge](double x) { return static_cast<uint64_t>(x / edge); };
            cubes.push_back(along(p.x - low.x) << 42 | along(p.y - low.y) << 21 | along(p.z - low.z));
        }
        std::sort(cubes.begin(), cubes.end());
        const auto taken = std::unique(cubes.begin(), cubes.end()) - cubes.begin();
        const double better = std::min(edge * cbrt(static_cast<double>(taken) / count), widest);
        if (better > 0.99 * spacing && better < 1.01 * spacing) break;
        spacing = better;
    }
    return spacing;
}

// The area that the smoke covers, seen from afar along an axis. A point covers a disc of this radius.
double covered_area(const std::vector<Double3> &points, const Axes &axes, double radius) {
    constexpr int64_t most = 2048; // cells along an edge
    const Extent x = extent_along(points, axes.right), y = extent_along(points, axes.up);
    const double longest = std::max(x.size(), y.size()) + 2 * radius;
    const double cell = std::max(radius / 4, longest / static_cast<double>(most));
    const auto cells = static_cast<int64_t>(longest / cell) + 1, reach = static_cast<int64_t>(radius / cell);
    std::vector<bool> covered(static_cast<size_t>(cells * cells));
    for (const Double3 &p : points) {
        const double px = dot(p, axes.right) - x.low + radius, py = dot(p, axes.up) - y.low + radius;
        if (!(px >= 0 && px < longest && py >= 0 && py < longest)) continue; // a stray
        const auto cx = static_cast<int64_t>(px / cell), cy = static_cast<int64_t>(py / cell);
        for (int64_t dy = -reach; dy <= reach; ++dy)
            for (int64_t dx = -reach; dx <= reach; ++dx) {
                const int64_t at_x = cx + dx, at_y = cy + dy;
                if (dx * dx + dy * dy > reach * reach || at_x < 0 || at_y < 0 || at_x >= cells || at_y >= cells)
                    continue;
                covered[static_cast<size_t>(at_y * cells + at_x)] = true;
            }
    }
    return static_cast<double>(std::count(covered.begin(), covered.end(), true)) * cell * cell;
}

// What all frames have in common.
struct Choice {
    Axes axes;
    Double3 vertical;       // of the world
    Extent right, up, back; // of all frames, along the axes
    Extent height;          // along the vertical
    // Of the frame that has most points.
    size_t count = 0;
    std::optional<double> radius; // smoothing length; none: the files have it, or hold grids
    double extinction = 0;
    bool is_grid = false, has_mass = false;

    Double3 middle() const { return axes.right * right.middle() + axes.up * up.middle() + axes.back * back.middle(); }
};

// The camera looks from a quarter to the right of the front, and 12 degrees from above.
Axes axes_of(const Double3 &vertical, const Double3 &front) {
    constexpr double sine = 0.4226, cosine = 0.9063, above = 0.2079, level = 0.9781; // of 25 and 12 degrees
    const Double3 side = cross(vertical, front);
    const Double3 back = unit(side * (sine * level) + front * (cosine * level) + vertical * above);
    const Double3 right = unit(cross(vertical, back));
    return {right, cross(back, right), back};
}

// The mean optical depth of rays that meet smoke.
constexpr double mean_depth = 2;
// Smoothing lengths are so many times the spacing of particles (Monaghan 2005: 1.2 to 1.5).
constexpr double lengths_of_spacing = 1.2;

// The smoothing length of particles whose file has none.
std::optional<double> radius_for(const Cloud &cloud) {
    if (cloud.reach > 0 || !cloud.radius.empty()) return std::nullopt;
    const double spacing = spacing_of(cloud.points);
    return spacing > 0 ? lengths_of_spacing * spacing : 1;
}

// From how far rays see a point. `radius`: the smoothing length, where it is not the file's.
double reach_of(const Cloud &cloud, std::optional<double> radius) {
    if (cloud.reach > 0) return cloud.reach;
    if (radius) return 2 * *radius;
    std::vector<double> sorted = cloud.radius;
    const auto middle = sorted.begin() + static_cast<ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    return 2 * *middle;
}

// With the file's masses, or 1 each. At most what a scene may say.
double extinction_for(const Cloud &cloud, const Axes &axes, double reach) {
    double area = 0;
    for (size_t i = 0; i < cloud.points.size(); ++i) area += cloud.area(i);
    return area > 0 ? std::min(mean_depth * covered_area(cloud.points, axes, reach) / area, 1e30) : 1;
}

// Extends the camera's frame to points that reach so far.
void frame(const std::vector<Double3> &points, double reach, Choice &choice) {
    const auto extend = [&](const Double3 &axis, Extent &all) {
        const Extent here = extent_along(points, axis);
        all.include({here.low - reach, here.high + reach});
    };
    extend(choice.axes.right, choice.right);
    extend(choice.axes.up, choice.up);
    extend(choice.axes.back, choice.back);
    extend(choice.vertical, choice.height);
}

// Takes the frame's extents, and, where it has most points so far, its numbers.
void include(const std::string &path, const std::string &grid, Choice &choice) {
    const Cloud cloud = read_cloud(path, grid);
    if (cloud.points.empty()) return;
    const std::optional<double> radius = radius_for(cloud);
    const double reach = reach_of(cloud, radius);
    frame(cloud.points, reach, choice);
    if (cloud.points.size() <= choice.count) return;
    choice.count = cloud.points.size();
    choice.radius = radius;
    choice.extinction = extinction_for(cloud, choice.axes, reach);
    choice.is_grid = cloud.reach > 0;
    choice.has_mass = cloud.has_mass;
}

// ---- The text

std::string number(double x) { return digits_of(x, 4); }
std::string words(const Double3 &v) { return digits_of(v.x, 7) + " " + digits_of(v.y, 7) + " " + digits_of(v.z, 7); }

// A line of the scene, and why.
std::string line(const std::string &statement, const std::string &why) { return statement + "   # " + why + "\n"; }

SceneFile::View view(const Choice &choice, const Options &options) {
    constexpr double tangent = 0.26795, filled = 0.85; // of half of 30 degrees; how much of the picture smoke takes
    const double wanted = std::clamp(choice.right.size() / choice.up.size(), 9.0 / 16, 16.0 / 9);
    const int width = options.width.value_or(static_cast<int>(64 * std::sqrt(wanted)) * 8),
              height = options.height.value_or(static_cast<int>(64 / std::sqrt(wanted)) * 8);
    const double aspect = static_cast<double>(width) / height;
    const double distance =
        choice.back.size() / 2 + std::max(choice.up.size(), choice.right.size() / aspect) / (2 * tangent * filled);
    const auto rounded = [distance](double x) { return std::fabs(x) < 1e-9 * distance ? 0.0 : x; };
    const Double3 middle = choice.middle();
    const Double3 at = {rounded(middle.x), rounded(middle.y), rounded(middle.z)};
    return {at + choice.axes.back * distance, at, choice.vertical, 30, width, height};
}

std::string words(const SceneFile::View &view) {
    return "v from " + words(view.from) + " at " + words(view.at) + " up " + words(view.up) + " angle " +
           number(view.angle) + " hither 0.01 resolution " + std::to_string(view.width) + " " +
           std::to_string(view.height);
}

// From above on the left, and from the right.
struct KeyAndFill {
    SceneFile::Light key, fill;
};
KeyAndFill lights(const Axes &axes) {
    const auto parallel = [&](double right, double up, double back, const Double3 &color) {
        const Double3 direction = unit(axes.right * -right + axes.up * -up + axes.back * -back);
        return SceneFile::Light{LightKind::parallel, {0, 0, 0}, direction, 0, color};
    };
    return {parallel(-0.6, 0.8, 0.5, {8, 7.6, 7}), parallel(0.9, 0.3, 0.6, {1.6, 1.8, 2.2})};
}

std::string words(const SceneFile::Light &light) { return "ld " + words(light.direction) + "  " + words(light.color); }

std::string ground(const Choice &choice) {
    const Axes &axes = choice.axes;
    const Double3 forward = cross(choice.vertical, axes.right);
    const double reach = 20 * std::max({choice.right.size(), choice.up.size(), choice.back.size()});
    const Double3 smoke = choice.middle();
    const Double3 below = smoke + choice.vertical * (choice.height.low - dot(smoke, choice.vertical));
    std::string text =
        line("f 0.9 0.95 1 0.05 0 0 0 1", "the ground's material") + line("p 4", "the ground, right below the smoke");
    for (const auto &[x, y] : {std::pair(-1, -1), std::pair(1, -1), std::pair(1, 1), std::pair(-1, 1)})
        text += "  " + words(below + axes.right * (x * reach) + forward * (y * reach)) + "\n";
    return text;
}

// The word for a name of `what`, a file or a grid.
std::string word_of(const std::string &path, const std::string &name, const std::string &what) {
    const std::optional<std::string> word = name_word(name);
    if (!word)
        throw InputError(path, "'\"' or a line end in the name, expected none: a scene cannot name such a " + what);
    return *word;
}

// What stands in the braces of the smoke; `grid` is a word or empty.
std::string smoke(const Choice &choice, const std::string &grid, const Sequence &sequence) {
    std::string text;
    if (!grid.empty()) text += "  grid " + grid + "\n";
    if (choice.radius)
        text += line("  radius " + number(*choice.radius),
                     number(lengths_of_spacing) + " times the cube root of the volume for each particle");
    if (!choice.is_grid && !choice.has_mass) text += "  mass 1\n";
    text += line("  extinction " + number(choice.extinction),
                 "for a mean optical depth of about " + number(mean_depth) + " where a ray meets smoke");
    text += "  albedo 0.9 0.9 0.9\n  phase 0\n";
    if (sequence.count > 1 || sequence.first != 0)
        text += line("  frames " + std::to_string(sequence.first) + " " + std::to_string(sequence.step),
                     "the first file's number, and the step");
    return text;
}

// A pipe cannot. Where the system does not say what it is, reading says why.
bool can_be_read_again(const std::string &path) {
    std::error_code ignored;
    const std::filesystem::file_type type = std::filesystem::status(path, ignored).type();
    return type == std::filesystem::file_type::regular || type == std::filesystem::file_type::none;
}

// Whether `is` says so of the first bytes. Not of a pipe.
template <class Is> bool begins(const std::string &path, Is is) {
    if (!can_be_read_again(path)) return false;
    const Bytes begin = read_beginning(path, 64);
    return is(begin.data(), begin.size());
}

Choice choice_of(Options::Up up) {
    const bool z_up = up == Options::Up::z;
    Choice choice = {};
    choice.vertical = z_up ? Double3{0, 0, 1} : Double3{0, 1, 0};
    choice.axes = axes_of(choice.vertical, z_up ? Double3{0, -1, 0} : Double3{0, 0, 1});
    return choice;
}

// What is in a smoke, in its own space. Boxes have their corners.
Cloud cloud_of(const SceneFile::SmokeVolume &smoke) {
    if (!smoke.box) return read_cloud(smoke.path(0), smoke.grid);
    const Double3 &low = smoke.box->low, &high = smoke.box->high;
    Cloud cloud;
    for (int i = 0; i < 8; ++i) cloud.points.push_back(corner_of_box(low, high, i));
    cloud.reach = 1e-3 * length(high - low);
    return cloud;
}

// Chooses the numbers that one smoke leaves out. Returns what was chosen, with a blank before each.
std::string complete(SceneFile::SmokeVolume &smoke, const Cloud &cloud, const Axes &axes) {
    if (cloud.reach > 0 || cloud.points.empty()) return "";
    std::string chosen;
    if (!smoke.radius) {
        smoke.radius = radius_for(cloud);
        smoke.chosen_radius = smoke.radius.has_value();
        if (smoke.radius) chosen += " radius " + number(*smoke.radius);
    }
    if (smoke.mass || cloud.has_mass) return chosen;
    smoke.mass = 1;
    smoke.chosen_mass = true;
    chosen += " mass 1";
    if (smoke.extinction) return chosen;
    smoke.extinction = extinction_for(cloud, axes, reach_of(cloud, smoke.radius));
    return chosen + " extinction " + number(*smoke.extinction);
}

// Whether there is no light, although smoke scatters some, and nothing shines by itself or behind it.
bool is_dark(const SceneFile &scene) {
    const auto shines = [](const Double3 &color) { return largest_component(color) > 0; };
    bool scatters = false;
    for (const SceneFile::SmokeVolume &smoke : scene.smokes) {
        if (glows(smoke.emission, smoke.albedo)) return false;
        scatters |= shines(smoke.albedo);
    }
    return scene.lights.empty() && scatters && !shines(scene.background);
}

// Whether nothing of it is to be chosen, or it cannot be read for that.
bool is_passed_over(const SceneFile::SmokeVolume &smoke, bool has_view) {
    if (smoke.box) return has_view;
    const std::string file = smoke.path(0);
    return !can_be_read_again(file) || (has_view && ((smoke.radius && smoke.mass) || begins(file, is_volume)));
}

} // namespace

bool is_smoke_file(const std::string &path) {
    return has_number(path) || begins(path, [](const unsigned char *data, size_t size) {
               return is_volume(data, size) || is_particles(data, size);
           });
}

ChosenScene::ChosenScene(const std::string &path, const Options &options) : path_(path) {
    const Sequence sequence = find_sequence(path);
    Choice choice = choice_of(options.up);
    for (int64_t frame = 0; frame < sequence.count; ++frame)
        include(numbered(path, sequence.number(frame)), options.grid, choice);
    if (choice.count == 0)
        throw InputError(path, "no smoke, expected particles, or a density grid with samples above 0");
    before_ = line(words(view(choice, options)), "frames all smoke") + line("b 0.03 0.04 0.06", "background") +
              line(words(lights(choice.axes).key), "key light") + line(words(lights(choice.axes).fill), "fill light");
    if (sequence.count > 1) before_ += line("a 0 1 " + std::to_string(sequence.count), "one frame for each file");
    smoke_ = smoke(choice, options.grid.empty() ? "" : word_of(path, options.grid, "grid"), sequence);
    left_out_ = sequence.left_out;
    if (options.ground) behind_ = ground(choice);
}

std::string ChosenScene::text(const std::string &named) const {
    const std::string word = word_of(path_, named, "file");
    return "# A scene about " + named + ", chosen by wisp. Change any number.\n" + before_ + "smoke " + word + " {\n" +
           smoke_ + "}\n" + behind_;
}

SceneFile ChosenScene::scene() const {
    return parse_scene(path_ + " (chosen scene)", text(std::filesystem::path(path_).filename().string()));
}

std::vector<std::string> complete_scene(SceneFile &scene) {
    std::vector<std::string> lines;
    Choice choice = choice_of(Options::Up::y);
    bool any = false;
    for (SceneFile::SmokeVolume &smoke : scene.smokes) try {
            if (is_passed_over(smoke, scene.view.has_value())) continue;
            Cloud cloud = cloud_of(smoke);
            if (cloud.points.empty()) continue;
            const std::string chosen = complete(smoke, cloud, choice.axes);
            if (!chosen.empty()) lines.push_back(smoke.where + ": chosen for what the smoke leaves out:" + chosen);
            if (scene.view) continue;
            for (Double3 &p : cloud.points) p = placed_in_world(scene.graph.nodes, smoke.node, p);
            frame(cloud.points, reach_of(cloud, smoke.radius) * scale_in_world(scene.graph.nodes, smoke.node), choice);
            any = true;
        } catch (const InputError &) {
        } // said where the file is read
    if (any) {
        scene.view = view(choice, {});
        lines.push_back("chosen, as there is no view: " + words(*scene.view));
    }
    if (scene.view && is_dark(scene)) {
        const Double3 back = unit(scene.view->from - scene.view->at), right = unit(cross(scene.view->up, back));
        const KeyAndFill chosen = lights({right, cross(back, right), back});
        scene.lights = {chosen.key, chosen.fill};
        lines.push_back("chosen, as there is no light: " + words(chosen.key) + " and " + words(chosen.fill));
    }
    return lines;
}

} // namespace wisp
