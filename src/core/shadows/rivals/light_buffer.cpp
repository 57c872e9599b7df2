// `lightbuffer`: the light buffer (Haines & Greenberg 1986) (C7). A grid of cells surrounds each light. Each cell lists
// the opaque static triangles that the light may see through it, nearest first.
//
// A shadow ray tests the triangles of the cell through which it reaches the light, as far as its own point. Each is
// tested as its tree tests it. A list holds every triangle that a ray through the cell may hit, so the answers are
// those of `trace`. Where one triangle covers all of a cell, points behind it are in shadow without a test. The grid of
// a light is made when the first ray asks, and made again when the light has changed. Rays are traced where a grid has
// no list: for points beside the grid, and for cells with too many triangles.
//
// Triangles are sorted into cells by integers, on the lattice of box_shaft.h, in coordinates of the light:
//
//   along   distance from the light along an axis. A light amid the triangles has a cube of six faces. A light far from
//           them has one face, along the axis nearest to its direction to them.
//   across  along the next two axes, less along * slope (of that direction), times gain. The gain is such that all
//           triangles lie in -along to along, for a parallel light in -reach to reach. A cube's slopes are 0, its
//           gains 1.
//
// So cells are cells of across / along. A parallel light is one before which all points have along = `reach`. A ray
// hits what lies within box_shaft.h's margin M of the segment from the light to its point. In coordinates of the light
// that is:
//
//   along: M; across: (M + 1 + (M + 1) slope) gain, where 1 covers the rounding of across; and 2 in both covers that of
//   a point and of a corner to units of 2^coarser steps. For parallel lights the slope is off by 2^-26 at most, so M
//   grows by 2 steps in 2^27.
//
// A cell is the cone of all (u, v, 1) * z with z >= 0 and low <= u, v <= high; the segments lie in it. The cell lists
// each triangle of which a corner is above low and one below high, in u and v, and which is not beside one of its own
// edges: in the plane of the light and an edge no point q of the cone that is within `margin` of the triangle is beyond
// the edge by more than margin * normal, and all such q are at least at the triangle's least distance from the light,
// in the largest coordinate, less the margin.
//
// A triangle covers a cell where all of the cone is inside its edges by so much that no rounding of corners and ray
// changes a sign of intersect() (triangle.h): of volumes (light, q, corner, corner) with coordinates below R. Each of
// those points is off by `margin` at most, with the light at 0 the three by twice that, which changes the volume by
// less than 3 * 3 * 2 R^2 * 2 margin = 36 R^2 margin.
#include "core/numbers/double_bits.h"
#include "core/shadows/box_shaft.h"
#include <algorithm>

namespace wisp::WISP_ARITH {

namespace {

constexpr uint32_t least_edge = 16, max_edge = 256; // of a cube's face, in cells
constexpr uint64_t max_entries = 1u << 23;          // of all lights
constexpr uint32_t max_listed = 512;                // in a cell
constexpr int32_t no_depth = 0x7fffffff;            // farther than all

constexpr int coarser = 7, slope_bits = 30, gain_bits = 8;
constexpr int64_t parallel_reach = 1 << 19;
constexpr int64_t max_gain = 1 << 16, max_margin = 1 << 10; // so that numbers stay below 2^63
constexpr int64_t farthest = 1 << 26;                       // steps, as box_shaft.h says

struct BufferEntry {
    uint32_t triangle;
    int32_t depth; // along, in units: no ray that hits it ends nearer to the light
};

struct BufferCell {
    uint32_t first, count; // of entries; count may be `traced`: there is no list
    int32_t covered;       // a point farther than this is in shadow

    static constexpr uint32_t traced = 0xffffffff;
};

// The coordinates of a light.
struct BufferView {
    LatticePoint origin;
    bool cube;
    int axis, sign; // of the face, if there is only one
    int64_t edge;   // of a face, in cells
    int64_t slope[2], gain[2];
    int64_t reach; // 0: not a parallel light
    int64_t margin[3], depth_margin;
};

struct BufferLight {
    Light light; // as it was when its lists were made

    enum : uint8_t { unresolved, listed, unlisted } state; // unlisted: roundings are too large for cells
    ShaftLattice lattice;
    BufferView view;
    BufferCell *cells;
    BufferEntry *entries;
};

struct LightBuffer {
    uint32_t light_count;
    uint32_t edge;        // of the face of a cube, in cells
    uint32_t entry_count; // of each light
    BufferLight *lights;
};

// Cells along an edge of a cube's face: twice the root of the number of triangles. A single face has as many as a cube.
uint32_t cube_edge(uint32_t triangles) {
    uint32_t edge = least_edge;
    while (edge < max_edge && uint64_t{edge} * edge < 4 * uint64_t{triangles}) ++edge;
    return edge;
}
uint32_t cells_of_cube(uint32_t edge) { return 6 * edge * edge; }
int64_t single_edge(int64_t edge) { return edge * 12 / 5; }

int64_t size_of(int64_t x) { return x < 0 ? -x : x; }
int64_t floor_divide(int64_t a, int64_t b) { return a >= 0 ? a / b : -((b - 1 - a) / b); } // b > 0

struct Projected {
    int64_t x[3]; // across twice, along
    int64_t depth;
};

// Faces 0, 1 look along +x, -x and so on; across are the next two axes.
struct Face {
    explicit Face(const BufferView &view, uint32_t face)
        : index(face), along(view.cube ? static_cast<int>(face / 2) : view.axis), across{along == 2 ? 0 : along + 1,
                                                                                         along == 0 ? 2 : along - 1},
          sign(!view.cube ? view.sign
               : face % 2 ? -1
                          : 1),
          cells(view.edge) {}

    Projected project(const BufferView &view, const LatticePoint &p) const {
        Projected result;
        const int64_t far = sign * (p.x[along] - view.origin.x[along]);
        for (int k = 0; k < 2; ++k) {
            const int64_t at = p.x[across[k]] - view.origin.x[across[k]] - ((far * view.slope[k]) >> slope_bits);
            result.x[k] = (at * view.gain[k]) >> (gain_bits + coarser);
        }
        result.depth = far >> coarser;
        result.x[2] = view.reach != 0 ? view.reach : result.depth;
        return result;
    }
    // across is -along to along, along > 0
    int64_t row_of(int64_t across_, int64_t along_) const {
        return std::min(std::max(floor_divide((across_ + along_) * cells, 2 * along_), int64_t{0}), cells - 1);
    }
    uint32_t index_of(int64_t i, int64_t j) const { return static_cast<uint32_t>((index * cells + j) * cells + i); }

    uint32_t index;
    int along, across[2], sign;
    int64_t cells;
};
uint32_t faces_of(const BufferView &view) { return view.cube ? 6 : 1; }

// False: roundings are too large for cells.
bool make_view(BufferView &view, const Light &light, const ShaftLattice &lattice, const TriangleTree &tree,
               uint32_t edge) {
    view = {};
    const bool parallel = light.kind == LightKind::parallel;
    LatticeBounds box = {lattice_point(tree.bounds.low, lattice.exponent),
                         lattice_point(tree.bounds.high, lattice.exponent)};
    LatticePoint towards; // from the light to the middle of the triangles
    if (parallel) {
        towards = lattice_point(light.direction, -28);
        for (int a = 0; a < 3; ++a) view.origin.x[a] = (box.low.x[a] + box.high.x[a]) / 2;
    } else {
        view.origin = lattice_point(light.position, lattice.exponent);
        for (int a = 0; a < 3; ++a) towards.x[a] = (box.low.x[a] + box.high.x[a]) / 2 - view.origin.x[a];
    }
    int64_t widest = 1;
    for (int a = 0; a < 3; ++a) {
        if (size_of(towards.x[a]) > size_of(towards.x[view.axis])) view.axis = a;
        widest = std::max(widest, box.high.x[a] - box.low.x[a]);
    }
    const int64_t far = size_of(towards.x[view.axis]);
    view.cube = !parallel && far < 2 * widest;
    view.edge = view.cube ? edge : single_edge(edge);
    view.sign = towards.x[view.axis] < 0 ? -1 : 1;
    view.gain[0] = view.gain[1] = 1 << gain_bits;
    const int64_t margin = lattice.margin + (parallel ? 2 : 0);
    if (!view.cube) {
        view.reach = parallel ? parallel_reach : 0;
        const Face face(view, 0);
        for (int k = 0; k < 2; ++k) {
            view.slope[k] = towards.x[face.across[k]] * (int64_t{1} << slope_bits) / far;
            view.gain[k] = std::min(max_gain, (max_margin << (gain_bits + coarser - 2)) / (margin + 1));
            for (int i = 0; i < 8; ++i) {
                const LatticePoint p = corner_of(box, i);
                const int64_t ahead = view.sign * (p.x[view.axis] - view.origin.x[view.axis]);
                const int64_t at =
                    p.x[face.across[k]] - view.origin.x[face.across[k]] - ((ahead * view.slope[k]) >> slope_bits);
                const int64_t room = parallel ? parallel_reach << coarser : ahead;
                view.gain[k] = std::min(view.gain[k], (room << gain_bits) / (size_of(at) + 2 * (margin + 1)));
            }
        }
    }
    for (int k = 0; k < 2; ++k) {
        const int64_t all = (margin + 1) + (((margin + 1) * size_of(view.slope[k])) >> slope_bits) + 1;
        view.margin[k] = ((all * view.gain[k]) >> (gain_bits + coarser)) + 3;
        if (view.margin[k] > max_margin || view.gain[k] <= 0) return false;
    }
    view.depth_margin = (margin >> coarser) + 3;
    view.margin[2] = parallel ? 0 : view.depth_margin;
    return view.depth_margin <= max_margin;
}

// A triangle in the coordinates of a face.
class Outline {
  public:
    Outline(const BufferView &view, const ShaftLattice &lattice, const Face &face, const LatticePoint (&corner)[3])
        : view_(view), cells_(face.cells) {
        nearest_ = farthest_ = 0;
        for (int c = 0; c < 3; ++c) {
            t_[c] = face.project(view, corner[c]);
            nearest_ = c == 0 ? t_[c].depth : std::min(nearest_, t_[c].depth);
            farthest_ = c == 0 ? t_[c].depth : std::max(farthest_, t_[c].depth);
        }
        ray_epsilon_ = (lattice.ray_epsilon >> coarser) + 1;
    }

    struct Cells {
        int64_t low[2], high[2]; // high: behind the last
    };

    // A range of cells, outside of which no cell lists the triangle; false: no cell does.
    bool find_cells(const Face &face, Cells &all) {
        const int64_t *const m = view_.margin;
        all = {{0, 0}, {cells_, cells_}};
        least_ = -m[2];
        for (int k = 0; k < 3; ++k) {
            const int64_t low = std::min(t_[0].x[k], std::min(t_[1].x[k], t_[2].x[k])),
                          high = std::max(t_[0].x[k], std::max(t_[1].x[k], t_[2].x[k]));
            least_ = std::max(least_, std::max(low, -high) - m[k]);
            if (k == 2 && high < std::max(least_, int64_t{0}) - m[2]) return false;
        }
        if (!between(all)) return false;
        const bool before = std::min(t_[0].x[2], std::min(t_[1].x[2], t_[2].x[2])) > m[2];
        for (int k = 0; k < 2 && before; ++k) {
            all.low[k] = cells_;
            all.high[k] = 0;
            for (const Projected &t : t_)
                for (const int64_t along : {t.x[2] - m[2], t.x[2] + m[2]}) {
                    all.low[k] = std::min(all.low[k], face.row_of(t.x[k] - m[k], along));
                    all.high[k] = std::max(all.high[k], face.row_of(t.x[k] + m[k], along) + 1);
                }
        }
        draw();
        return true;
    }

    bool may_be_in(const Cells &cells) const {
        if (!between(cells)) return false;
        if (least_ <= 0) return true;
        for (int e = 0; e < 3; ++e) {
            const Range side = range_of(line_[e], cells);
            if (side_ == 0 ? side.low > beyond_[e] || side.high < -beyond_[e] : side.high < -beyond_[e]) return false;
        }
        return true;
    }

    // The depth of its entry in these cells; false: the triangle is not in them.
    bool find_depth(const Cells &cell, int32_t &depth) const {
        int64_t nearest = nearest_ - view_.depth_margin;
        if (height_ > 0) {
            const int64_t steepest = range_of(normal_, cell).high;
            if (steepest <= 0) return false;
            nearest = std::max(nearest, height_ * cells_ / steepest);
        }
        depth = static_cast<int32_t>(std::min(nearest, int64_t{no_depth}));
        return true;
    }

    // The depth beyond which all of these cells is in its shadow, or no_depth.
    int32_t covered_beyond(const Cells &cell) const {
        if (!may_cover_) return no_depth;
        for (const auto &line : line_)
            if (range_of(line, cell).low <= inside_) return no_depth;
        return static_cast<int32_t>(farthest_ + 4 * view_.depth_margin + ray_epsilon_);
    }

  private:
    struct Range {
        int64_t low, high;
    };

    // Of normal . (u, v, 1) * cells in these cells.
    Range range_of(const int64_t (&normal)[3], const Cells &cells) const {
        Range range = {normal[2] * cells_, normal[2] * cells_};
        for (int k = 0; k < 2; ++k) {
            const int64_t low = normal[k] * (2 * cells.low[k] - cells_),
                          high = normal[k] * (2 * cells.high[k] - cells_);
            range.low += std::min(low, high);
            range.high += std::max(low, high);
        }
        return range;
    }

    bool between(const Cells &cells) const {
        for (int k = 0; k < 2; ++k) {
            const int64_t low = 2 * cells.low[k] - cells_, high = 2 * cells.high[k] - cells_;
            bool above = false, below = false;
            for (const Projected &t : t_) {
                const int64_t at = t.x[k] * cells_, more = cells_ * view_.margin[k];
                above = above || at - low * t.x[2] + more + size_of(low) * view_.margin[2] >= 0;
                below = below || high * t.x[2] - at + more + size_of(high) * view_.margin[2] >= 0;
            }
            if (!above || !below) return false;
        }
        return true;
    }

    void draw() {
        const int64_t *const m = view_.margin;
        const auto cross = [](const int64_t(&a)[3], const int64_t(&b)[3], int64_t(&n)[3]) {
            n[0] = a[1] * b[2] - a[2] * b[1];
            n[1] = a[2] * b[0] - a[0] * b[2];
            n[2] = a[0] * b[1] - a[1] * b[0];
        };
        const auto size = [m](const int64_t(&n)[3]) {
            return size_of(n[0]) * m[0] + size_of(n[1]) * m[1] + size_of(n[2]) * m[2];
        };
        const auto dot = [](const int64_t(&a)[3], const int64_t(&b)[3]) {
            return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        };
        for (int e = 0; e < 3; ++e) cross(t_[e].x, t_[e == 2 ? 0 : e + 1].x, line_[e]);
        const int64_t volume = dot(line_[0], t_[2].x);
        side_ = volume > 0 ? 1 : volume < 0 ? -1 : 0;
        for (int e = 0; e < 3; ++e) {
            if (side_ < 0)
                for (int64_t &n : line_[e]) n = -n;
            beyond_[e] = least_ > 0 ? size(line_[e]) * cells_ / least_ + 1 : 0;
        }
        const int64_t depth_margin = view_.depth_margin, off = std::max(depth_margin, std::max(m[0], m[1]));
        if (view_.reach == 0) {
            int64_t edge[2][3];
            for (int e = 0; e < 2; ++e)
                for (int k = 0; k < 3; ++k) edge[e][k] = t_[e + 1].x[k] - t_[0].x[k];
            cross(edge[0], edge[1], normal_);
            for (int64_t &n : normal_) n >>= 16;
            const int64_t at[3] = {dot(normal_, t_[0].x), dot(normal_, t_[1].x), dot(normal_, t_[2].x)};
            int64_t low = std::min(at[0], std::min(at[1], at[2])), high = std::max(at[0], std::max(at[1], at[2]));
            if (high < 0) {
                for (int64_t &n : normal_) n = -n;
                low = -high;
            }
            height_ = low - size(normal_);
            if (nearest_ < ray_epsilon_ + 8 * depth_margin)
                return; // too near to the light to be sure that it is before it
        }
        // Volumes are computed where the cones are as far away as the farthest corner.
        const int64_t plane = view_.reach != 0 ? view_.reach : farthest_;
        if (side_ == 0 || plane <= 4 * off) return;
        int64_t reach = plane;
        for (const Projected &t : t_)
            for (const int64_t x : t.x) reach = std::max(reach, size_of(x));
        reach += 2 * off;
        may_cover_ = true;
        inside_ = (40 * reach * reach * off / plane + 1) * cells_;
    }

    const BufferView &view_;
    int64_t cells_, nearest_, farthest_, ray_epsilon_;
    int64_t least_ = 0; // along, of all in cells that is hit
    Projected t_[3];
    int side_ = 0; // of its edges' planes on which it is, 0: either
    int64_t line_[3][3], beyond_[3];
    bool may_cover_ = false;
    int64_t inside_ = 0;
    int64_t normal_[3], height_ = 0; // of its plane: all of it that is hit is at least so far along the normal
};

// Calls visit(index of a cell, cell, outline) for each cell that may have to list the triangle.
template <class Visit>
void for_each_cell_of(const BufferLight &light, const LatticePoint (&corner)[3], uint64_t &tests, Visit &&visit) {
    for (uint32_t f = 0; f < faces_of(light.view); ++f) {
        const Face face(light.view, f);
        Outline outline(light.view, light.lattice, face, corner);
        Outline::Cells stack[24];
        ++tests;
        if (!outline.find_cells(face, stack[0])) continue;
        for (int count = 1; count > 0;) {
            const Outline::Cells cells = stack[--count];
            ++tests;
            if (!outline.may_be_in(cells)) continue;
            const int64_t width = cells.high[0] - cells.low[0], height = cells.high[1] - cells.low[1];
            if (width == 1 && height == 1) {
                visit(face.index_of(cells.low[0], cells.low[1]), cells, outline);
                continue;
            }
            const int k = width >= height ? 0 : 1;
            const int64_t middle = (cells.low[k] + cells.high[k]) / 2;
            stack[count] = stack[count + 1] = cells;
            stack[count++].low[k] = middle;
            stack[count++].high[k] = middle;
        }
    }
}

constexpr uint32_t units_of_lists = 1 << 14; // of work, beside that of their triangles

void make_lists(const LightBuffer &buffer, BufferLight &light, const Shadows &shadows) {
    const Scene &scene = *shadows.scene;
    const TriangleTree &tree = shadows.surfaces->static_tree;
    light.lattice = make_shaft_lattice(*shadows.surfaces, light_exponent(tree, light.light));
    light.state = BufferLight::unlisted;
    if (!shadows.watch.go_on(units_of_lists) || !make_view(light.view, light.light, light.lattice, tree, buffer.edge))
        return;
    light.state = BufferLight::listed;
    uint64_t &tests = shadows.statistics->shadow.proofs.triangle_tests;
    const auto for_each_entry = [&](auto &&visit) {
        uint64_t asked = tests;
        for (uint32_t i = 0; i < scene.static_count; ++i) {
            if (i % 16 == 15) {
                if (!shadows.watch.go_on(static_cast<uint32_t>(tests - asked))) return;
                asked = tests;
            }
            const Triangle &triangle = scene.triangles[i];
            const Vec3 corner[3] = {vec_of(triangle.corner[0]), vec_of(triangle.corner[1]), vec_of(triangle.corner[2])};
            if (total_order_key(scene.materials[triangle.material].transmission) > 0 ||
                !has_area(corner[0], corner[1], corner[2]))
                continue;
            const LatticePoint points[3] = {lattice_point(corner[0], light.lattice.exponent),
                                            lattice_point(corner[1], light.lattice.exponent),
                                            lattice_point(corner[2], light.lattice.exponent)};
            for_each_cell_of(light, points, tests,
                             [&](uint32_t index, const Outline::Cells &cells, const Outline &outline) {
                                 BufferEntry entry = {i, 0};
                                 BufferCell &cell = light.cells[index];
                                 if (outline.find_depth(cells, entry.depth) && entry.depth <= cell.covered)
                                     visit(cell, entry, outline, cells);
                             });
        }
    };
    BufferCell *const end = light.cells + cells_of_cube(buffer.edge);
    std::fill(light.cells, end, BufferCell{0, 0, no_depth});
    for_each_entry([](BufferCell &cell, const BufferEntry &, const Outline &outline, const Outline::Cells &cells) {
        ++cell.count;
        cell.covered = std::min(cell.covered, outline.covered_beyond(cells));
    });
    if (shadows.watch.stopped()) light.state = BufferLight::unlisted;
    uint32_t used = 0;
    for (BufferCell *cell = light.cells; cell != end; ++cell) {
        cell->first = used;
        if (cell->count > max_listed || cell->count > buffer.entry_count - used) {
            cell->count = BufferCell::traced;
        } else {
            used += cell->count;
            cell->count = 0;
        }
    }
    // `covered` is final now, so this visits no more entries than were counted.
    for_each_entry([&light](BufferCell &cell, const BufferEntry &entry, const Outline &, const Outline::Cells &) {
        if (cell.count != BufferCell::traced) light.entries[cell.first + cell.count++] = entry;
    });
    for (BufferCell *cell = light.cells; cell != end; ++cell)
        if (cell->count > 1 && cell->count != BufferCell::traced && shadows.watch.go_on(cell->count))
            std::sort(light.entries + cell->first, light.entries + cell->first + cell->count,
                      [](const BufferEntry &a, const BufferEntry &b) {
                          return a.depth < b.depth || (a.depth == b.depth && a.triangle < b.triangle);
                      });
}

uint32_t entries_for(const Scene &scene) {
    const uint64_t fair = max_entries / max(scene.light_count, 1u);
    return static_cast<uint32_t>(
        std::min(fair, 16 * uint64_t{scene.static_count} + 2 * cells_of_cube(cube_edge(scene.static_count))));
}

// The cell of a point, and the point's depth; nullptr: the point is beside the grid.
const BufferCell *find_cell(const BufferLight &light, const TriangleTree &tree, const Vec3 &from, int64_t &depth) {
    const Real reach = tree.largest * Real(2); // as far as whole numbers go
    if (!(abs(from.x) <= reach && abs(from.y) <= reach && abs(from.z) <= reach)) return nullptr;
    const LatticePoint at = lattice_point(from, light.lattice.exponent);
    for (const int64_t x : at.x)
        if (x < -farthest || x >= farthest) return nullptr;
    uint32_t index = 0;
    if (light.view.cube) {
        const auto offset = [&](int a) { return at.x[a] - light.view.origin.x[a]; };
        int axis = 0;
        for (int a = 1; a < 3; ++a)
            if (size_of(offset(a)) > size_of(offset(axis))) axis = a;
        index = static_cast<uint32_t>(2 * axis + (offset(axis) < 0 ? 1 : 0));
    }
    const Face face(light.view, index);
    const Projected point = face.project(light.view, at);
    depth = point.depth;
    if (point.x[2] < 0) return nullptr;
    const int64_t along = std::max(point.x[2], int64_t{1});
    for (int k = 0; k < 2; ++k)
        if (size_of(point.x[k]) > along + 1) return nullptr; // by one: they are rounded apart
    return light.cells + face.index_of(face.row_of(point.x[0], along), face.row_of(point.x[1], along));
}

uint64_t buffer_bytes(const Scene &scene, const Settings &) {
    return Arena::bytes<LightBuffer>(1) + Arena::bytes<BufferLight>(scene.light_count) +
           scene.light_count * (Arena::bytes<BufferCell>(cells_of_cube(cube_edge(scene.static_count))) +
                                Arena::bytes<BufferEntry>(entries_for(scene)));
}

void *make_buffer(const Scene &scene, const Settings &, Arena &arena, Watch) {
    LightBuffer *buffer = arena.make<LightBuffer>(1);
    BufferLight *lights = arena.make<BufferLight>(scene.light_count);
    if (!buffer || !lights) return nullptr;
    *buffer = {scene.light_count, cube_edge(scene.static_count), entries_for(scene), lights};
    for (uint32_t l = 0; l < scene.light_count; ++l) {
        lights[l] = {};
        lights[l].cells = arena.make<BufferCell>(cells_of_cube(buffer->edge));
        lights[l].entries = arena.make<BufferEntry>(buffer->entry_count);
        if (!lights[l].cells || !lights[l].entries) return nullptr;
    }
    return buffer;
}

bool begin_buffer_frame(Shadows &shadows, const Settings &, Arena &) {
    LightBuffer &buffer = memory_of<LightBuffer>(shadows);
    for (uint32_t l = 0; l < buffer.light_count; ++l) {
        BufferLight &light = buffer.lights[l];
        if (!same_shadows(light.light, shadows.lights[l])) light.state = BufferLight::unresolved;
        light.light = shadows.lights[l];
    }
    return true;
}

bool is_shadowed_by_buffer(Shadows &shadows, const ShadowQuery &query) {
    LightBuffer &buffer = memory_of<LightBuffer>(shadows);
    const Surfaces &surfaces = *shadows.surfaces;
    Statistics &statistics = *shadows.statistics;
    if (surfaces.static_tree.triangle_count == 0) return is_blocked_by_moving(shadows, query);
    BufferLight &light = buffer.lights[query.light];
    if (light.state == BufferLight::unresolved) make_lists(buffer, light, shadows);
    int64_t depth;
    const BufferCell *const cell =
        light.state == BufferLight::listed ? find_cell(light, surfaces.static_tree, query.ray.origin, depth) : nullptr;
    if (cell && depth > cell->covered) {
        ++statistics.rays.shadow_culled;
        return true;
    }
    if (!cell || cell->count == BufferCell::traced) return is_blocked(shadows, query);
    const TriangleRay ray(query.ray.origin, query.ray.direction);
    const BufferEntry *const first = light.entries + cell->first;
    bool tested = false;
    for (const BufferEntry *entry = first; entry != first + cell->count && entry->depth <= depth; ++entry) {
        if (entry->triangle == query.triangle) continue;
        tested = true;
        ++statistics.shadow.extra_tests;
        if (intersects(*shadows.scene, entry->triangle, ray, query.begin, query.end)) return true;
    }
    return tested ? is_blocked_by_moving(shadows, query) : is_shadowed_by_moving_alone(shadows, query);
}

} // namespace

const ShadowTechnique lightbuffer_technique = {is_shadowed_by_buffer, buffer_bytes, make_buffer, begin_buffer_frame};

} // namespace wisp::WISP_ARITH
