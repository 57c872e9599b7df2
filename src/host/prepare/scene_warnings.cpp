#include "core/lights/least_distance.h"
#include "core/smoke/grid_samples.h"
#include "core/smoke/resampling.h"
#include "host/base/double3_algebra.h"
#include "host/base/text.h"
#include "host/prepare/core_units.h"
#include "host/prepare/extinction.h"
#include "host/prepare/frustum.h"
#include "host/prepare/motion.h"
#include "host/prepare/scene_warnings.h"
#include "host/prepare/unit.h"
#include <algorithm>
#include <array>
#include <cmath>

namespace wisp {

namespace {

// A smoke of less depth than this, and of less radiance, changes no pixel that is seen.
constexpr double invisible = 1e-3;
// Of a smoke of more depth than this only the outermost thousandth is seen.
constexpr double solid = 1e3;
// Mean free paths to which f32 places what is seen: single scattering of a box errs by 1 % at 0.15, and by 5 % at 0.3.
constexpr double coarse = 0.1;

// Of fewer particles a support may hold all.
constexpr uint32_t many = 100;

bool shines(const Double3 &color) { return color.x > 0 || color.y > 0 || color.z > 0; }

// --- what the camera sees -------------------------------------------------------------------------------------------

bool misses(const Frustum &view, const SmokeDescription &smoke) {
    if (!smoke.is_grid())
        return std::all_of(smoke.particles, smoke.particles + smoke.count,
                           [&view](const Particle &p) { return view.misses({p.position}, 2 * p.h); });
    const GridDescription &grid = smoke.grid;
    const Double3 x = grid.axis[0] * grid.half.x, y = grid.axis[1] * grid.half.y, z = grid.axis[2] * grid.half.z,
                  &c = grid.center;
    return view.misses({c - x - y - z, c - x - y + z, c - x + y - z, c - x + y + z, c + x - y - z, c + x - y + z,
                        c + x + y - z, c + x + y + z});
}

Double3 placed(const Instance &instance, const Double3 &p) {
    return instance.axis[0] * p.x + instance.axis[1] * p.y + instance.axis[2] * p.z + instance.origin;
}

// Whether is_one(triangle, its corners in the world) holds for one of the triangles that are there.
template <class IsOne> bool any_triangle(const Scene &scene, IsOne &&is_one) {
    const auto among = [&](uint32_t first, uint32_t count, auto &&place) {
        return std::any_of(scene.triangles + first, scene.triangles + first + count, [&](const Triangle &t) {
            return is_one(t, place(t.corner[0]), place(t.corner[1]), place(t.corner[2]));
        });
    };
    const auto there = [](const Double3 &p) { return p; };
    if (among(0, scene.static_count, there) ||
        among(scene.static_count + scene.instance_triangle_count, scene.deforming_count, there))
        return true;
    return std::any_of(scene.instances, scene.instances + scene.instance_count, [&](const Instance &instance) {
        return instance.visible &&
               among(instance.first, instance.count, [&](const Double3 &p) { return placed(instance, p); });
    });
}

bool sees_surfaces(const Frustum &view, const Scene &scene) {
    return any_triangle(scene, [&](const Triangle &, const Double3 &a, const Double3 &b, const Double3 &c) {
        return !view.misses({a, b, c});
    });
}

// --- distances -------------------------------------------------------------------------------------------------------

double distance_to_segment(const Double3 &p, const Double3 &a, const Double3 &b) {
    const Double3 along = b - a, to_p = p - a;
    const double square = dot(along, along), t = square > 0 ? dot(to_p, along) / square : 0;
    return length(to_p - along * std::clamp(t, 0.0, 1.0));
}
double distance_to_triangle(const Double3 &p, const Double3 &a, const Double3 &b, const Double3 &c) {
    const Double3 normal = cross(b - a, c - a);
    const auto is_inside = [&](const Double3 &from, const Double3 &to) {
        return dot(cross(to - from, p - from), normal) > 0;
    };
    if (is_inside(a, b) && is_inside(b, c) && is_inside(c, a)) return std::fabs(dot(p - a, normal)) / length(normal);
    return std::min({distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

// --- optical depth --------------------------------------------------------------------------------------------------

// Adds columns of equal width.
class Columns {
  public:
    void add(double depth) {
        if (!(depth > 0)) return;
        sum_ += depth;
        largest_ = std::max(largest_, depth);
        ++count_;
    }
    double mean() const { return count_ > 0 ? sum_ / static_cast<double>(count_) : 0; }
    double largest() const { return largest_; }

  private:
    double sum_ = 0, largest_ = 0;
    uint64_t count_ = 0;
};

// Particles by the columns along `axis`, as wide as the widest support.
Columns particle_columns(const SmokeDescription &smoke, int axis) {
    const double width = 2 * smoke.largest_h;
    Columns columns;
    for (double area : areas_in_cells(smoke, width, axis)) columns.add(area / (width * width));
    return columns;
}

// Those of the samples of a grid along an edge of its box.
Columns grid_columns(const GridDescription &grid, int axis) {
    const int32_t counts[] = {grid.nx, grid.ny, grid.nz};
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    const double depth_of_sample = grid.extinction * 2 * component(grid.half, axis) / counts[axis];
    std::vector<double> sums(static_cast<size_t>(counts[u]) * static_cast<size_t>(counts[v]), grid.density ? 0 : 1);
    if (grid.density)
        for_each_run(grid, [&](int32_t x, int32_t y, int32_t z, const float *densities, int32_t count) {
            for (int32_t i = 0; i < count; ++i) {
                const int32_t at[] = {x + i, y, z};
                sums[static_cast<size_t>(at[v]) * static_cast<size_t>(counts[u]) + static_cast<size_t>(at[u])] +=
                    static_cast<double>(densities[i]);
            }
            return true;
        });
    Columns columns;
    for (const double sum : sums) columns.add(sum * depth_of_sample);
    return columns;
}

// --- the warnings ---------------------------------------------------------------------------------------------------

class Doubts {
  public:
    Doubts(const std::string &name, const SceneFile &file, const Options &options, int64_t frame,
           const PreparedScene &prepared)
        : name_(name), file_(file), options_(options), frame_(frame), prepared_(prepared), scene_(prepared.scene) {}

    std::vector<Warning> find() {
        warnings_ = file_.graph.warnings;
        warnings_.insert(warnings_.end(), prepared_.warnings.begin(), prepared_.warnings.end());
        for (size_t i = 0; i < file_.smokes.size(); ++i) look_at(file_.smokes[i], scene_.smokes[i]);
        look_at_view();
        look_at_motions();
        look_at_times();
        look_at_lights();
        look_at_digits();
        look_at_far_surfaces();
        look_at_near_lights();
        look_at_rays();
        return std::move(warnings_);
    }

  private:
    void warn(const char *kind, const std::string &place, const std::string &text) {
        warnings_.push_back({kind, place, text});
    }

    // One smoke: whether something is there, and can be seen.
    void look_at(const SceneFile::SmokeVolume &said, const SmokeDescription &smoke) {
        const std::string path = said.path(frame_);
        if (smoke.empty())
            return warn("empty smoke", said.where,
                        path + " has no particles" +
                            (options_.decimate > 0 ? ", or --thin leaves out all of them" : ""));
        if (!(smoke.total_area > 0)) return warn("empty smoke", said.where, nothing_in(said, smoke, path));
        const SmokeExtent extent = extent_of(smoke.particles, smoke.count, smoke);
        if (smoke.count > many && 2 * smoke.smallest_h > largest(extent.high - extent.low))
            warn("wide smoke", said.where,
                 "the supports of the smoke's particles are wider than the smoke: most of its " +
                     std::to_string(smoke.count) + " particles are in each; is the radius too large?");
        if (shines(smoke.emission) && !glows(smoke.emission, smoke.albedo))
            warn("emission", said.where,
                 "'emission' does nothing: the smoke emits where it absorbs, and its albedo is 1");
        const DepthRange depth = depths_through(smoke);
        const double brightest = std::ldexp(1.0, scene_.radiance_exponent + static_cast<int>(options_.exposure));
        if (depth.largest < invisible && depth.largest * brightest < invisible)
            warn("thin smoke", said.where,
                 "the smoke is all but invisible: its optical depth is at most " + two_digits(depth.largest) +
                     "; is the " + (smoke.is_grid() ? "density" : "mass") + " or the extinction too small?");
        if (depth.least_mean > solid)
            warn("solid smoke", said.where,
                 "the smoke is like a solid: its mean optical depth is " + two_digits(depth.least_mean) + "; is the " +
                     (smoke.is_grid() ? "density or the extinction too large?"
                                      : "mass or the extinction too large, or the radius too small?"));
        // A place on a ray is rounded in proportion to its distance from the eye.
        const double supports = smoke.is_grid() ? 0 : 4 * smoke.largest_h; // around the outermost particles
        const Double3 size = extent.high - extent.low + Double3{supports, supports, supports};
        const double away = length(scene_.camera.origin - (extent.low + extent.high) * 0.5) + length(size) / 2,
                     free_path = std::min({size.x, size.y, size.z}) / depth.least_mean;
        if (options_.arithmetic == Arithmetic::f32 && away * 0x1p-23 > coarse * free_path)
            warn("coarse places", said.where,
                 "f32 places what the camera sees to within " + two_digits(away * 0x1p-23 / free_path) +
                     " mean free paths in this smoke; --arith f64 has digits for it");
    }
    static std::string nothing_in(const SceneFile::SmokeVolume &said, const SmokeDescription &smoke,
                                  const std::string &path) {
        if (said.extinction == 0) return "the smoke is invisible: its extinction is 0";
        if (said.box) return "the smoke is invisible: its density is 0";
        return path + (smoke.is_grid() ? " has no sample above 0" : " has no particle with a mass above 0");
    }

    void look_at_view() {
        if (file_.smokes.empty() && scene_.triangle_count() == 0)
            return warn("view", name_, "the scene has neither smoke nor surfaces: the picture is its background");
        if (!has_smoke(scene_) && scene_.triangle_count() == 0) return; // warned of
        const Frustum view(scene_.camera, prepared_.width, prepared_.height);
        const bool smoke = std::any_of(scene_.smokes, scene_.smokes + scene_.smoke_count,
                                       [&view](const SmokeDescription &s) { return !s.empty() && !misses(view, s); });
        if (!smoke && !sees_surfaces(view, scene_))
            warn("view", name_,
                 "nothing is in view in frame " + std::to_string(frame_) +
                     ": the camera looks past all smoke and surfaces, or they are invisible");
    }

    // Times that descend are read as other programs read them, which is hardly what was meant.
    void look_at_times() {
        const auto descend = [](const auto &keys) {
            return !std::is_sorted(keys.begin(), keys.end(),
                                   [](const auto &a, const auto &b) { return a.time < b.time; });
        };
        for (const auto &[name, motion] : file_.graph.motions) {
            const std::pair<const char *, bool> tracks[] = {{"transl", descend(motion.translation)},
                                                            {"rot", descend(motion.rotation)},
                                                            {"scale", descend(motion.scale)},
                                                            {"visibility", descend(motion.visibility)}};
            for (const auto &[track, wrong] : tracks)
                if (wrong)
                    warn("times", name_, "the times of '" + std::string(track) + "' in 'k " + name + "' descend");
            if (const size_t key = key_after_half_turn(motion.rotation))
                warn("turn", name_,
                     "keys " + std::to_string(key) + " and " + std::to_string(key + 1) + " of 'rot' in 'k " + name +
                         "' are half a turn or more apart: the turn is the shorter one, and uneven (behind 315 comes "
                         "360, then 405, not 45)");
        }
    }

    // A misspelt name leaves a motion without what it moves, and a node without its motion, where it is.
    void look_at_motions() {
        for (const auto &entry : file_.graph.motions) {
            const std::string &motion = entry.first;
            const auto moves = [&motion](const auto &what) { return what.name == motion; };
            if (std::any_of(file_.graph.nodes.begin(), file_.graph.nodes.end(), moves)) continue;
            const bool camera = motion == "camera",
                       light = std::any_of(file_.lights.begin(), file_.lights.end(), moves);
            if (!camera && !light) {
                warn("motion", name_,
                     "the motion '" + motion + "' moves nothing: there is neither an 'x " + motion +
                         "' nor a light 'la' of this name");
                continue;
            }
            const std::pair<const char *, bool> idle[] = {{"rot", light && !entry.second.rotation.empty()},
                                                          {"scale", !entry.second.scale.empty()},
                                                          {"visibility", !entry.second.visibility.empty()}};
            for (const auto &[track, does_nothing] : idle)
                if (does_nothing)
                    warn("track", name_,
                         "'" + std::string(track) + "' in 'k " + motion + "' does nothing: a " +
                             (camera ? "camera has 'transl' and 'rot'" : "light has 'transl'") + " alone");
        }
    }

    // A material of 1e-6 errs by 0.4 % in fixed point, of 1e-7 by 4 %. A channel so much darker than the brightest of
    // its light has less than 8 of the 32 bits.
    void look_at_digits() {
        if (options_.arithmetic != Arithmetic::fixed) return;
        for (uint32_t i = 0; i < scene_.material_count; ++i) {
            const Material &m = scene_.materials[i];
            const double brightest = std::max({largest_component(m.ambient), largest_component(m.diffuse),
                                               largest_component(m.specular), m.transmission});
            if (brightest > 0 && brightest < 0x1p-19) {
                warn("digits of materials", name_,
                     "fixed point has few digits for a material whose brightest colour is " + two_digits(brightest) +
                         "; --arith f32 and f64 have");
                break;
            }
        }
        for (uint32_t i = 0; i < scene_.light_count; ++i) {
            const Double3 &color = scene_.lights[i].color;
            for (const double channel : {color.x, color.y, color.z})
                if (channel > 0 && channel < 0x1p-24 * largest_component(color))
                    return warn("digits", name_,
                                "fixed point has no digits for a channel of a light that is " +
                                    two_digits(channel / largest_component(color)) +
                                    " of the light's brightest one; --arith f32 and f64 have");
        }
    }

    void look_at_lights() {
        const auto shine = [](const auto &of) { return shines(of); };
        for (uint32_t i = 0; i < scene_.light_count; ++i)
            if (shines(scene_.lights[i].color)) return;
        bool dark = false;
        for (uint32_t i = 0; i < scene_.smoke_count; ++i) {
            const SmokeDescription &smoke = scene_.smokes[i];
            if (!(smoke.total_area > 0)) continue;
            if (glows(smoke.emission, smoke.albedo)) return;
            dark |= shine(smoke.albedo);
        }
        const auto can_shine = [&](const Material &material) { // by itself, or by the background that it shows
            return shine(material.ambient) ||
                   (shines(scene_.background) && (shine(material.specular) || material.transmission > 0));
        };
        const bool black = scene_.triangle_count() > 0 &&
                           std::none_of(scene_.materials, scene_.materials + scene_.material_count, can_shine);
        if (!dark && !black) return;
        const std::string what = dark && black ? "the smoke and the surfaces are"
                                 : dark        ? "the smoke is"
                                               : "the surfaces are";
        warn("light", name_,
             (scene_.light_count > 0 ? "all lights are of power 0: " : "there is no light: ") + what + " black");
    }

    // Rays off a surface start a millionth of the diagonal of all that never moves away from it, and end as much before
    // a light. Spheres of radius 0.3 in smoke, with a still triangle so far away that this is 0.1, 1 and 10: right,
    // 2 to 10 % too dark, 20 to 65 % too dark.
    void look_at_far_surfaces() {
        if (scene_.static_count == 0) return;
        std::vector<double> spans; // of each triangle, and its way from the middle of most
        std::array<std::vector<double>, 3> places;
        const auto for_each_still = [&](auto &&visit) {
            for (const Triangle *t = scene_.triangles; t < scene_.triangles + scene_.static_count; ++t)
                visit(t->corner[0], t->corner[1], t->corner[2]);
        };
        const auto median = [](std::vector<double> &values) {
            const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
            std::nth_element(values.begin(), middle, values.end());
            return *middle;
        };
        for_each_still([&](const Double3 &a, const Double3 &, const Double3 &) {
            for (size_t axis = 0; axis < 3; ++axis) places[axis].push_back(component(a, static_cast<int>(axis)));
        });
        const Double3 most = {median(places[0]), median(places[1]), median(places[2])};
        for_each_still([&](const Double3 &a, const Double3 &b, const Double3 &c) {
            spans.push_back(length(a - most) + length(b - a) + length(c - a));
        });
        double span = median(spans);
        for (uint32_t i = 0; i < scene_.smoke_count; ++i)
            if (scene_.smokes[i].smallest_h > 0) span = std::min(span, 100 * scene_.smokes[i].smallest_h);
        if (scene_.ray_epsilon < 0.05 * span) return;
        warn("far surfaces", name_,
             "surfaces reach so far that rays off a surface, and to a light, miss what is near its end: within a "
             "millionth of the diagonal of all that never moves, which is " +
                 two_digits(scene_.ray_epsilon / span) + " of what most of them span" +
                 (span < median(spans) ? ", or a hundred smoothing lengths" : "") + "; leave out what is far away");
    }

    // A light that falls off is hardly brighter than at the least distance. Where a pixel is wider, nobody sees it.
    void look_at_near_lights() {
        const Camera &camera = scene_.camera;
        const Double3 middle =
            camera.corner + camera.right * (prepared_.width / 2.0) + camera.down * (prepared_.height / 2.0);
        for (uint32_t i = 0; i < scene_.light_count; ++i) {
            const LightSource &light = scene_.lights[i];
            if (light.kind != LightKind::point && light.kind != LightKind::spot) continue;
            const double pixel = length(camera.right) / length(middle) * length(light.position - camera.origin);
            if (pixel > least_light_distance) continue;
            if (!any_triangle(scene_, [&](const Triangle &, const Double3 &a, const Double3 &b, const Double3 &c) {
                    return distance_to_triangle(light.position, a, b, c) < least_light_distance;
                }))
                continue;
            return warn(
                "near light", name_,
                "a surface is nearer than " + two_digits(least_light_distance / prepared_.scale) +
                    " to a light, and is lit as if it were so far away: no arithmetic tells less beside surfaces "
                    "that reach so far; leave out what is far away");
        }
    }

    // A surface that sends on more than it receives: rays that weigh little are not sent, and these do not become less.
    void look_at_rays() {
        constexpr double many_rays = 1e4; // a pixel, of those that are seen by one camera ray
        double most = 0;
        for (uint32_t i = 0; i < scene_.material_count; ++i) {
            const Material &m = scene_.materials[i];
            if (largest(m.specular) > 0 && m.transmission > 0)
                most = std::max(most, largest(m.specular) + m.transmission);
        }
        double rays = 1;
        for (uint32_t i = 0; i < options_.depth && rays < 1e12; ++i) rays *= most;
        if (rays > many_rays)
            warn("many rays", name_,
                 "a surface reflects and lets through " + two_digits(most) +
                     " times what it receives, so one camera ray may be followed by " + two_digits(rays) +
                     " others within --depth " + std::to_string(options_.depth));
    }

    const std::string &name_;
    const SceneFile &file_;
    const Options &options_;
    int64_t frame_;
    const PreparedScene &prepared_;
    const Scene &scene_;
    std::vector<Warning> warnings_;
};

// The box around all smoke.
SmokeExtent extent_of_smoke(const Scene &scene) {
    std::vector<SmokeExtent> smokes;
    for (uint32_t i = 0; i < scene.smoke_count; ++i)
        smokes.push_back(extent_of(scene.smokes[i].particles, scene.smokes[i].count, scene.smokes[i]));
    return extent_of_all(smokes);
}

// Whether the straight line from p to q crosses a triangle: the line through both passes its edges on one side, and p
// and q are on two sides of its plane.
bool crosses(const Double3 &p, const Double3 &q, const Double3 &a, const Double3 &b, const Double3 &c) {
    const auto side = [&](const Double3 &from, const Double3 &to) { return dot(q - p, cross(from - p, to - p)); };
    const double ab = side(a, b), bc = side(b, c), ca = side(c, a);
    const bool within = (ab >= 0 && bc >= 0 && ca >= 0) || (ab <= 0 && bc <= 0 && ca <= 0);
    const Double3 normal = cross(b - a, c - a);
    return within && dot(normal, p - a) * dot(normal, q - a) < 0;
}

} // namespace

bool shows_light_through_smoke(const PreparedScene &prepared) {
    const Scene &scene = prepared.scene;
    const SmokeExtent smoke = extent_of_smoke(scene);
    const Frustum view(scene.camera, prepared.width, prepared.height);
    return smoke.any() && std::any_of(scene.lights, scene.lights + scene.light_count, [&](const LightSource &light) {
               const Double3 at = light.kind == LightKind::parallel
                                      ? scene.camera.origin - light.direction * (4 * coordinate_limit)
                                      : light.position;
               const auto hides = [&](const Triangle &t, const Double3 &a, const Double3 &b, const Double3 &c) {
                   return scene.materials[t.material].transmission <= 0 && crosses(scene.camera.origin, at, a, b, c);
               };
               return shines(light.color) && !view.misses({at}) &&
                      meets_box(smoke.low, smoke.high, scene.camera.origin, at - scene.camera.origin, 1) &&
                      !any_triangle(scene, hides);
           });
}

bool holds_light_at_eye(const Scene &scene, double distance) {
    const SmokeExtent smoke = extent_of_smoke(scene);
    const Double3 &eye = scene.camera.origin;
    return smoke.any() && meets_box(smoke.low, smoke.high, eye, {0, 0, 0}, 0) &&
           std::any_of(scene.lights, scene.lights + scene.light_count, [&](const LightSource &light) {
               return (light.kind == LightKind::point || light.kind == LightKind::spot) && shines(light.color) &&
                      length(light.position - eye) < distance;
           });
}

bool stands_in_smoke(const Scene &scene) {
    const SmokeExtent smoke = extent_of_smoke(scene);
    if (!smoke.any()) return false;
    const Double3 margin = (smoke.high - smoke.low) * 0.05, low = smoke.low + margin, high = smoke.high - margin;
    return any_triangle(scene, [&](const Triangle &t, const Double3 &a, const Double3 &b, const Double3 &c) {
        if (scene.materials[t.material].transmission > 0) return false;
        for (int axis = 0; axis < 3; ++axis) {
            const double x = component(a, axis), y = component(b, axis), z = component(c, axis);
            if (std::max({x, y, z}) < component(low, axis) || std::min({x, y, z}) > component(high, axis)) return false;
        }
        return true;
    });
}

DepthRange depths_through(const SmokeDescription &smoke) {
    DepthRange range = {INFINITY, 0};
    for (int axis = 0; axis < 3; ++axis) {
        const Columns columns = smoke.is_grid() ? grid_columns(smoke.grid, axis) : particle_columns(smoke, axis);
        range.least_mean = std::min(range.least_mean, columns.mean());
        range.largest = std::max(range.largest, columns.largest());
    }
    return range;
}

std::vector<Warning> scene_warnings(const std::string &name, const SceneFile &file, const Options &options,
                                    int64_t frame, const PreparedScene &prepared) {
    return Doubts(name, file, options, frame, prepared).find();
}

} // namespace wisp
