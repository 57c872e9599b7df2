#include "host/commands/show_stages.h"
#include "core/numbers/elementary.h"
#include "host/commands/projection.h"
#include "host/images/drawing.h"
#include "wisp/layers.h"
#include "wisp/probe.h"
#include <cmath>
#include <functional>

namespace wisp {

namespace {

constexpr Double3 black = {0, 0, 0}, dark_grey = {0.01, 0.011, 0.013}, white = {1, 1, 1};
constexpr double nearest_depth = 1e-6; // that a projection shows

// ---- What the core tells

// Runs the stages that make what the probe asks for.
void ask(const Drawing &drawing, const Probe &probe) {
    constexpr decltype(&f32::show) show[] = {f32::show, f64::show, fixed::show};
    std::vector<float> rgb(3 * drawing.frame.settings.crop.pixels());
    drawing.frame.run([&](Job &job) {
        job.rgb = rgb.data();
        return show[static_cast<int>(drawing.request.options.arithmetic)](job, probe);
    });
}

// Numbers of pixels.
struct Field {
    std::vector<double> values;
    std::vector<uint64_t> cells;

    double most() const {
        double most = 0;
        for (const double value : values)
            if (value > most) most = value;
        return most;
    }
};

// At the points of the pixels; without points, along their rays.
Field field_of(const Drawing &drawing, Quantity quantity, const std::vector<Double3> &points = {}) {
    std::vector<float> values(drawing.frame.settings.crop.pixels());
    Field field = {{}, std::vector<uint64_t>(values.size())};
    Probe probe = {};
    probe.quantity = quantity;
    probe.light = drawing.options.light;
    probe.points = points.data();
    probe.count = points.size();
    probe.values = values.data();
    probe.cells = field.cells.data();
    ask(drawing, probe);
    field.values.assign(values.begin(), values.end());
    return field;
}

template <class Visit> void for_each_mark(const Drawing &drawing, Quantity quantity, Visit &&visit) {
    std::function<void(const Mark &)> visitor = visit;
    Probe probe = {};
    probe.quantity = quantity;
    probe.context = &visitor;
    probe.on_mark = [](void *context, const Mark &mark) {
        (*static_cast<std::function<void(const Mark &)> *>(context))(mark);
    };
    ask(drawing, probe);
}

// ---- What several drawings share

Projection projection_of(const Drawing &drawing) {
    return Projection(drawing.frame.prepared.scene.camera, drawing.frame.settings.crop);
}

Picture heat_of(const Drawing &drawing, const Field &field, double most) {
    const Crop &crop = drawing.frame.settings.crop;
    return heat_picture(crop.width(), crop.height(), field.values, most, black);
}

std::string heat_text(double most, const std::string &unit = "") {
    return "black 0, by purple and orange to light yellow " + six_digits(most) + unit;
}

std::string of_light(const Drawing &drawing) { return "light " + std::to_string(drawing.options.light); }

// The plane of option --slice.
double slice_depth(const Drawing &drawing, const Projection &projection) {
    const SmokeExtent all = extent_of_all(extents_of(drawing.frame.prepared));
    const double support = 2 * all.largest_h;
    const Double3 low = all.low - Double3{support, support, support}, size = all.high - all.low,
                  edge = size + Double3{2 * support, 2 * support, 2 * support};
    double near = projection.depth(low), far = near;
    for (int corner = 1; corner < 8; ++corner) {
        const double depth =
            projection.depth(low + Double3{corner & 1 ? edge.x : 0, corner & 2 ? edge.y : 0, corner & 4 ? edge.z : 0});
        near = std::min(near, depth);
        far = std::max(far, depth);
    }
    if (!(far > nearest_depth))
        throw Error(exit_usage, drawing.request.name, "the smoke lies behind the eye, expected it in front");
    near = std::max(near, nearest_depth);
    return near + drawing.options.slice * (far - near);
}

std::string plane_text(const Drawing &drawing, double distance) {
    return "in the plane " + six_digits(distance / drawing.frame.prepared.scale) + " before the eye";
}

// The smoke as a background: as much grey as it hides.
Picture dim_smoke(const Drawing &drawing) {
    const Crop &crop = drawing.frame.settings.crop;
    Picture picture{crop.width(), crop.height(), {}};
    for (const double depth : field_of(drawing, Quantity::optical_depth).values)
        picture.rgb.insert(picture.rgb.end(), 3, static_cast<float>(0.006 + 0.05 * (1 - exp(-depth))));
    return picture;
}

// ---- Stages

Shown draw_plane(const Drawing &drawing, Quantity quantity, double unit, const std::string &what,
                 const std::string &unit_name) {
    const Projection projection = projection_of(drawing);
    const double depth = slice_depth(drawing, projection);
    Field field = field_of(drawing, quantity, projection.plane(depth));
    for (double &value : field.values) value *= unit;
    Shown shown = {heat_of(drawing, field, field.most()), what + " " + plane_text(drawing, projection.distance(depth)) +
                                                              ": " + heat_text(field.most(), unit_name) +
                                                              "; lines are borders of the sparse grid's bricks"};
    draw_borders(shown.picture, field.cells, white, 0.08);
    return shown;
}

Shown draw_density(const Drawing &drawing) {
    return draw_plane(drawing, Quantity::density, drawing.frame.prepared.scale, "extinction of the smoke",
                      " a unit of length");
}

Shown draw_light_depth(const Drawing &drawing) {
    return draw_plane(drawing, Quantity::light_depth, 1, "optical depth to " + of_light(drawing), "");
}

Shown draw_depth(const Drawing &drawing) {
    const Field field = field_of(drawing, Quantity::optical_depth);
    return {heat_of(drawing, field, field.most()), "optical depth of the smoke: " + heat_text(field.most())};
}

Shown draw_photons(const Drawing &drawing) {
    const Projection projection = projection_of(drawing);
    const Crop &crop = drawing.frame.settings.crop;
    Picture sums{crop.width(), crop.height(), std::vector<float>(3 * crop.pixels())};
    for_each_mark(drawing, Quantity::photons, [&](const Mark &mark) {
        if (!(projection.depth(mark.to) > nearest_depth)) return;
        const PicturePoint at = projection.place(mark.to);
        add_point(sums, at.x, at.y, white * mark.value);
    });
    Field roots;
    for (size_t i = 0; i < sums.rgb.size(); i += 3) roots.values.push_back(std::sqrt(static_cast<double>(sums.rgb[i])));
    const double most = roots.most();
    return {heat_of(drawing, roots, most), "photons that collide in a pixel, by their root: " + heat_text(most * most)};
}

void draw_flight(Picture &picture, const Projection &projection, Double3 from, Double3 to, const Double3 &light) {
    double near = projection.depth(from), far = projection.depth(to);
    if (near > far) {
        std::swap(near, far);
        std::swap(from, to);
    }
    if (!(far > nearest_depth)) return;
    if (near < nearest_depth) from = from + (to - from) * ((nearest_depth - near) / (far - near));
    const PicturePoint a = projection.place(from), b = projection.place(to);
    add_line(picture, a.x, a.y, b.x, b.y, light);
}

Shown draw_paths(const Drawing &drawing) {
    constexpr uint64_t drawn = 150;
    constexpr Double3 colors[] = {{0.5, 0.4, 0.12}, {0.5, 0.07, 0.02}, {0.14, 0.06, 0.4}}; // by flight
    const Projection projection = projection_of(drawing);
    const uint64_t every = std::max<uint64_t>(drawing.frame.settings.photons / drawn, 1);
    Shown shown = {dim_smoke(drawing), "paths of one photon in " + std::to_string(every) +
                                           ": yellow from the light, red once scattered, blue more often"};
    uint64_t photon = 0, flight = 0;
    for_each_mark(drawing, Quantity::flights, [&](const Mark &mark) {
        flight = mark.photon == photon ? flight + 1 : 0;
        photon = mark.photon;
        if (photon % every == every / 2)
            draw_flight(shown.picture, projection, mark.from, mark.to, colors[std::min<uint64_t>(flight, 2)]);
    });
    return shown;
}

// What one in a hundred exceeds: light where there is hardly any smoke may be far too bright.
double most_of(const std::vector<Mark> &nodes) {
    std::vector<double> values;
    for (const Mark &node : nodes) values.push_back(node.value);
    if (values.empty()) return 0;
    const auto most = values.end() - 1 - static_cast<ptrdiff_t>(values.size() / 100);
    std::nth_element(values.begin(), most, values.end());
    return *most;
}

Shown draw_nodes(const Drawing &drawing) {
    const Projection projection = projection_of(drawing);
    const double depth = slice_depth(drawing, projection), distance = projection.distance(depth);
    std::vector<Mark> nodes;
    for_each_mark(drawing, Quantity::nodes, [&](const Mark &mark) {
        if (std::fabs(projection.distance(projection.depth(mark.to)) - distance) > mark.size / 2) return;
        nodes.push_back(mark);
    });
    const double most = most_of(nodes);
    Shown shown = {dim_smoke(drawing),
                   std::to_string(nodes.size()) + " nodes of the irradiance map " + plane_text(drawing, distance) +
                       ", mean radiance of light that was scattered before: purple 0, by orange to light yellow " +
                       six_digits(std::ldexp(most, drawing.frame.prepared.scene.radiance_exponent)) + " or more"};
    for (const Mark &node : nodes) {
        const PicturePoint at = projection.place(node.to);
        draw_disc(shown.picture, at.x, at.y, projection.size(node.size, depth) * 0.4,
                  heat_color(0.15 + 0.85 * std::min(node.value / most, 1.0)));
    }
    return shown;
}

Shown draw_tree(const Drawing &drawing) {
    const PreparedScene &prepared = drawing.frame.prepared;
    const Crop &crop = drawing.frame.settings.crop;
    const int row = drawing.options.row.value_or(prepared.height / 2);
    if (row >= prepared.height)
        throw Error(exit_usage, "option 'row': found '" + std::to_string(row) +
                                    "', expected a whole number from 0 to " + std::to_string(prepared.height - 1));
    Section section(prepared.scene.camera, row);
    if (!section.fit(prepared.scene, prepared.width, prepared.height, crop))
        throw Error(exit_usage, drawing.request.name,
                    "the plane of row " + std::to_string(row) + " meets no triangle, expected another --row");
    const Field field = field_of(drawing, Quantity::tree, section.points(crop));
    const double most = field.most();
    Shown shown = {heat_of(drawing, field, 1.5 * most), // without yellow, on which white lines would be lost
                   "the plane of row " + std::to_string(row) +
                       " from above, triangles in the leaves that hold a point: black 0, by purple to orange " +
                       six_digits(most) + "; blue lines are borders of cells, white ones are triangles"};
    draw_borders(shown.picture, field.cells, {0.2, 0.5, 0.6}, 0.5);
    for (const Section::Segment &segment : section.segments())
        add_line(shown.picture, segment.from.x, segment.from.y, segment.to.x, segment.to.y, white);
    return shown;
}

Shown draw_visits(const Drawing &drawing) {
    SingleFrame &frame = drawing.frame;
    const size_t count = frame.settings.crop.pixels();
    std::vector<float> rgb(3 * count), layers(count * planes_of(frame.plan.layers));
    frame.run([&](Job &job) {
        job.rgb = rgb.data();
        job.layers = layers.data();
        return renderer_of(drawing.request.options.arithmetic).render(job);
    });
    const float *visits =
        layers.data() + count * planes_before(frame.plan.layers, static_cast<uint32_t>(Layer::node_visits));
    Field field;
    for (size_t i = 0; i < count; ++i) field.values.push_back(static_cast<double>(visits[i]) / frame.settings.samples);
    return {heat_of(drawing, field, field.most()),
            "nodes of triangle trees that a camera ray, and what it is reflected or refracted to, visit: " +
                heat_text(field.most())};
}

Shown draw_proofs(const Drawing &drawing) {
    if (drawing.frame.settings.shadows != ShadowMethod::exact)
        throw Error(exit_usage, "option 'shadows' does not go with show proofs, expected exact, which alone proves");
    constexpr Double3 colors[] = {{0.12, 0.12, 0.12}, {0.8, 0.6, 0.15}, {0.02, 0.07, 0.3}, {0.6, 0.06, 0.03}};
    static_assert(static_cast<int>(CellState::mixed) == 3, "colours by state");
    const Crop &crop = drawing.frame.settings.crop;
    const Field field = field_of(drawing, Quantity::proofs);
    Shown shown = {{crop.width(), crop.height(), {}},
                   "cells of static triangles towards " + of_light(drawing) +
                       ": yellow proved lit, blue proved in shadow, red neither, grey too few rays so far"};
    for (const double value : field.values) {
        const Double3 &color = value != value ? dark_grey : colors[static_cast<int>(value)];
        for (const double channel : {color.x, color.y, color.z})
            shown.picture.rgb.push_back(static_cast<float>(channel));
    }
    draw_borders(shown.picture, field.cells, black, 0.5);
    return shown;
}

// One frame after the other, as the paper's method learns from all before; then the last one by `exact`.
Shown draw_wrong(const Drawing &drawing) {
    if (drawing.request.options.crop)
        throw Error(exit_usage,
                    "option 'crop' does not go with show wrong: the paper's method learns from whole pictures");
    SingleFrame &frame = drawing.frame;
    const Renderer &renderer = renderer_of(drawing.request.options.arithmetic);
    const int64_t last = drawing.request.frames.first;
    const auto render = [&](ShadowMethod shadows, FrameCache *cache) {
        frame.settings.shadows = shadows;
        frame.make_plan();
        Picture picture{frame.prepared.width, frame.prepared.height, {}};
        picture.rgb.resize(3 * frame.settings.crop.pixels());
        frame.run([&](Job &job) {
            job.rgb = picture.rgb.data();
            job.cache = cache;
            return renderer.render(job);
        });
        return picture;
    };
    Picture paper;
    for (int64_t i = 0; i <= last; ++i) {
        frame.prepare(i);
        paper = render(ShadowMethod::paper, &frame.cache);
    }
    const Picture exact = render(ShadowMethod::exact, nullptr);

    Shown shown = {{exact.width, exact.height, {}}, ""};
    std::vector<PicturePoint> wrong;
    for (int y = 0; y < exact.height; ++y)
        for (int x = 0; x < exact.width; ++x) {
            const size_t i = shown.picture.rgb.size();
            const float *a = &exact.rgb[i], *b = &paper.rgb[i];
            shown.picture.rgb.insert(shown.picture.rgb.end(), 3, 0.05f * (a[0] + a[1] + a[2]));
            if (!std::equal(a, a + 3, b)) wrong.push_back({x + 0.5, y + 0.5});
        }
    for (const PicturePoint &at : wrong) draw_disc(shown.picture, at.x, at.y, 3, {0.3, 0.02, 0.01});
    for (const PicturePoint &at : wrong) draw_disc(shown.picture, at.x, at.y, 0.5, {1, 0.3, 0.1});
    shown.legend = std::to_string(wrong.size()) + " pixels of frame " + std::to_string(last) +
                   " that --shadows paper gets wrong: red, in a dark red disc; grey is the picture of exact";
    return shown;
}

} // namespace

std::vector<double> optical_depths(const Request &request, SingleFrame &frame) {
    return field_of({request, {}, frame}, Quantity::optical_depth).values;
}

const std::vector<ShownStage> &shown_stages() {
    static const std::vector<ShownStage> stages = {
        {"density",
         "extinction of the smoke in a plane, and the bricks of the sparse grid",
         {"slice"},
         Stage::march,
         false,
         draw_density},
        {"depth",
         "optical depth of the smoke along the rays of the pixels, up to the first surface",
         {},
         Stage::march,
         false,
         draw_depth},
        {"light-depth",
         "optical depth from a light to the points of a plane: the smoke's own shadow",
         {"slice", "light"},
         Stage::light_depths,
         false,
         draw_light_depth},
        {"photons", "where photons collide with the smoke", {}, Stage::photons, false, draw_photons},
        {"paths", "paths of some photons", {}, Stage::photons, false, draw_paths},
        {"nodes", "nodes of the irradiance map in a plane", {"slice"}, Stage::irradiance, false, draw_nodes},
        {"tree",
         "cells of the triangle trees in the plane of a row of pixels, seen from above (--tree box|kd)",
         {"row"},
         Stage::triangle_trees,
         false,
         draw_tree},
        {"visits",
         "nodes of triangle trees that the rays of a pixel visit",
         {},
         Stage::triangle_trees,
         true,
         draw_visits},
        {"proofs",
         "cells of static triangles: proved lit by a light, proved in shadow, or neither",
         {"light"},
         Stage::shadows,
         false,
         draw_proofs},
        {"wrong",
         "pixels that --shadows paper, which learns from frame 0 on, gets wrong",
         {},
         Stage::shadows,
         false,
         draw_wrong},
    };
    return stages;
}

} // namespace wisp
