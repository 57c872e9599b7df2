// The air that carries the smoke: stable fluids (Stam 1999) on a MAC grid of 65 x 19 x 26 unit cells in a closed box
// with walls that slip. The long axis x points up: a warm spot near the floor drives a plume towards the ceiling.
// Lengths are in cells, times in frames.
//
// Invariants:
// * after step() the velocity has no divergence but for rounding, since the pressure is solved exactly, by cosine
//   transforms; and Velocity::at() keeps that at every point, so that particles neither gather nor thin out;
// * double, + - * / sqrt, sums in a fixed order: every machine gives the same bits.
#pragma once
#define GLM_FORCE_PURE
#define GLM_FORCE_XYZW_ONLY
#include "core/numbers/elementary.h"
#include "core/numbers/random.h"
#include <cstdint>
#include <glm/vec3.hpp>
#include <utility>
#include <vector>

namespace wisp::plume {

using Vec3 = glm::dvec3;

constexpr int cells_x = 65, cells_y = 19, cells_z = 26;
constexpr Vec3 box_size{cells_x, cells_y, cells_z};

inline double length(const Vec3 &v) { return sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

// ---- Values on a grid

// Values at the points first + (i, j, k), 0 <= (i, j, k) < (nx, ny, nz); k runs fastest.
struct Lattice {
    Lattice(int nx_, int ny_, int nz_, const Vec3 &first_)
        : nx(nx_), ny(ny_), nz(nz_), first(first_), values(static_cast<size_t>(nx_) * ny_ * nz_) {}

    size_t index(int i, int j, int k) const { return (static_cast<size_t>(i) * ny + j) * nz + k; }
    double &operator()(int i, int j, int k) { return values[index(i, j, k)]; }
    double operator()(int i, int j, int k) const { return values[index(i, j, k)]; }
    Vec3 point(int i, int j, int k) const { return first + Vec3(i, j, k); }

    int nx, ny, nz;
    Vec3 first;
    std::vector<double> values;
};

// action(i, j, k) for all points, in the order of `values`.
template <class Action> void for_each_point(int nx, int ny, int nz, Action action) {
    for (int i = 0; i < nx; ++i)
        for (int j = 0; j < ny; ++j)
            for (int k = 0; k < nz; ++k) action(i, j, k);
}
template <class Action> void for_each_point(const Lattice &lattice, Action action) {
    for_each_point(lattice.nx, lattice.ny, lattice.nz, action);
}

// The cell of eight lattice points around p, which is moved into the lattice where it lies outside.
struct LatticeCell {
    LatticeCell(const Lattice &lattice, const Vec3 &p)
        : step_x(static_cast<size_t>(lattice.ny) * lattice.nz), step_y(static_cast<size_t>(lattice.nz)) {
        const int i = split(p.x - lattice.first.x, lattice.nx, fx);
        const int j = split(p.y - lattice.first.y, lattice.ny, fy);
        const int k = split(p.z - lattice.first.z, lattice.nz, fz);
        corner = lattice.values.data() + lattice.index(i, j, k);
    }
    double trilinear() const {
        const double low = mix(along_z(0), along_z(step_y), fy);
        const double high = mix(along_z(step_x), along_z(step_x + step_y), fy);
        return mix(low, high, fx);
    }
    // x clamped to the range of the eight values.
    double clamp(double x) const {
        double low = corner[0], high = corner[0];
        for (const size_t offset : {size_t{0}, step_y, step_x, step_x + step_y})
            for (const double value : {corner[offset], corner[offset + 1]}) {
                low = min(low, value);
                high = max(high, value);
            }
        return min(max(x, low), high);
    }

  private:
    static int split(double x, int count, double &fraction) {
        const double inside = min(max(x, 0.0), count - 1.0);
        const int i = min(static_cast<int>(inside), count - 2);
        fraction = inside - i;
        return i;
    }
    static double mix(double a, double b, double f) { return a + f * (b - a); }
    double along_z(size_t offset) const { return mix(corner[offset], corner[offset + 1], fz); }

    size_t step_x, step_y;
    double fx, fy, fz;
    const double *corner;
};

// ---- Velocity

// Where x lies along one axis of `cells` cells, between the faces 0..cells and between the centres 0..cells - 1: points
// and their weights. Beyond a wall the velocity is mirrored, so that across faces it changes sign.
struct Stencil {
    Stencil(double x, int cells) {
        const double inside = min(max(x, 0.0), static_cast<double>(cells));
        const int i = static_cast<int>(inside + 0.5);
        const double f = inside - i, low = 0.5 - f, high = 0.5 + f;
        centre[0] = max(i - 1, 0);
        centre[1] = min(i, cells - 1);
        centre_weight[0] = low;
        centre_weight[1] = high;
        face[0] = i == 0 ? 1 : i - 1;
        face[1] = i;
        face[2] = i == cells ? cells - 1 : i + 1;
        face_weight[0] = (i == 0 ? -0.5 : 0.5) * low * low;
        face_weight[1] = 0.75 - f * f;
        face_weight[2] = (i == cells ? -0.5 : 0.5) * high * high;
    }
    int face[3], centre[2];
    double face_weight[3];   // quadratic B-spline
    double centre_weight[2]; // linear
};

// The components live on the faces that they cross.
struct Velocity {
    Lattice x{cells_x + 1, cells_y, cells_z, {0, 0.5, 0.5}};
    Lattice y{cells_x, cells_y + 1, cells_z, {0.5, 0, 0.5}};
    Lattice z{cells_x, cells_y, cells_z + 1, {0.5, 0.5, 0}};

    // The derivative of a quadratic B-spline along its axis is the linear one of the differences. So the divergence
    // of this interpolation is that of the cells, interpolated trilinearly: zero where theirs is.
    Vec3 at(const Vec3 &p) const {
        const Stencil sx(p.x, cells_x), sy(p.y, cells_y), sz(p.z, cells_z);
        Vec3 sum(0);
        for (int a = 0; a < 3; ++a)
            for (int b = 0; b < 2; ++b)
                for (int c = 0; c < 2; ++c) {
                    sum.x += sx.face_weight[a] * sy.centre_weight[b] * sz.centre_weight[c] *
                             x(sx.face[a], sy.centre[b], sz.centre[c]);
                    sum.y += sx.centre_weight[b] * sy.face_weight[a] * sz.centre_weight[c] *
                             y(sx.centre[b], sy.face[a], sz.centre[c]);
                    sum.z += sx.centre_weight[b] * sy.centre_weight[c] * sz.face_weight[a] *
                             z(sx.centre[b], sy.centre[c], sz.face[a]);
                }
        return sum;
    }
    Vec3 at_centre(int i, int j, int k) const {
        return 0.5 * Vec3(x(i, j, k) + x(i + 1, j, k), y(i, j, k) + y(i, j + 1, k), z(i, j, k) + z(i, j, k + 1));
    }
    double divergence(int i, int j, int k) const {
        return x(i + 1, j, k) - x(i, j, k) + y(i, j + 1, k) - y(i, j, k) + z(i, j, k + 1) - z(i, j, k);
    }
};

// The way in `time` of a point that is at p with velocity `here`: midpoint rule.
inline Vec3 displacement(const Velocity &velocity, const Vec3 &p, const Vec3 &here, double time) {
    return time * velocity.at(p + 0.5 * time * here);
}

// The ways of the cells' centres in a frame, to where they were and to where they will be.
struct Traces {
    struct Ways {
        Vec3 back, ahead;
    };
    explicit Traces(const Velocity &velocity) : ways(static_cast<size_t>(cells_x) * cells_y * cells_z) {
        for_each_point(cells_x, cells_y, cells_z, [&](int i, int j, int k) {
            const Vec3 p = Vec3(i, j, k) + 0.5, here = velocity.at_centre(i, j, k);
            ways[index(i, j, k)] = {displacement(velocity, p, here, -1), displacement(velocity, p, here, 1)};
        });
    }
    // Those of a point of `lattice`: a centre or, as the mean of the cells on both sides, a face.
    Ways at(const Lattice &lattice, int i, int j, int k) const {
        const Ways &a = ways[index(max(i - (lattice.nx > cells_x), 0), max(j - (lattice.ny > cells_y), 0),
                                   max(k - (lattice.nz > cells_z), 0))];
        const Ways &b = ways[index(min(i, cells_x - 1), min(j, cells_y - 1), min(k, cells_z - 1))];
        return {0.5 * (a.back + b.back), 0.5 * (a.ahead + b.ahead)};
    }
    static size_t index(int i, int j, int k) { return (static_cast<size_t>(i) * cells_y + j) * cells_z + k; }

    std::vector<Ways> ways;
};

// `q` carried along for one frame: MacCormack's scheme, limited to the values that each point came from (Selle et al.
// 2008).
inline Lattice advect(const Lattice &q, const Traces &traces) {
    Lattice forward = q, result = q;
    for_each_point(q, [&](int i, int j, int k) {
        forward(i, j, k) = LatticeCell(q, q.point(i, j, k) + traces.at(q, i, j, k).back).trilinear();
    });
    for_each_point(q, [&](int i, int j, int k) {
        const Vec3 p = q.point(i, j, k);
        const Traces::Ways ways = traces.at(q, i, j, k);
        const double there_and_back = LatticeCell(forward, p + ways.ahead).trilinear();
        const double corrected = forward(i, j, k) + 0.5 * (q(i, j, k) - there_and_back);
        result(i, j, k) = LatticeCell(q, p + ways.back).clamp(corrected);
    });
    return result;
}

// ---- Pressure

// Solves the Poisson equation on the cells exactly: cosines with a whole number of half waves between the walls are
// the eigenvectors of the Laplacian whose gradient vanishes at the walls.
class PressureSolver {
  public:
    PressureSolver() : axes_{Axis(cells_x), Axis(cells_y), Axis(cells_z)} {}

    // Takes the gradient of a pressure from `velocity`, so that nothing crosses a wall and no cell is a source.
    void project(Velocity &velocity) const {
        stop_at_walls(velocity);
        Lattice p(cells_x, cells_y, cells_z, Vec3(0.5));
        for_each_point(p, [&](int i, int j, int k) { p(i, j, k) = -velocity.divergence(i, j, k); });
        transform(p, false);
        for_each_point(p, [&](int i, int j, int k) {
            const double eigenvalue = axes_[0].eigenvalue[i] + axes_[1].eigenvalue[j] + axes_[2].eigenvalue[k];
            p(i, j, k) = eigenvalue > 0 ? p(i, j, k) / eigenvalue : 0;
        });
        transform(p, true);
        for_each_point(p, [&](int i, int j, int k) {
            if (i > 0) velocity.x(i, j, k) -= p(i, j, k) - p(i - 1, j, k);
            if (j > 0) velocity.y(i, j, k) -= p(i, j, k) - p(i, j - 1, k);
            if (k > 0) velocity.z(i, j, k) -= p(i, j, k) - p(i, j, k - 1);
        });
    }

  private:
    struct Axis {
        explicit Axis(int cells_) : cells(cells_), eigenvalue(cells_), basis(static_cast<size_t>(cells_) * cells_) {
            for (int wave = 0; wave < cells; ++wave) {
                double sine, cosine;
                sincos_turns(wave / (2.0 * cells), sine, cosine);
                eigenvalue[wave] = 2 - 2 * cosine;
                const double unit = sqrt((wave == 0 ? 1.0 : 2.0) / cells);
                for (int i = 0; i < cells; ++i) {
                    sincos_turns(wave * (2 * i + 1) / (4.0 * cells), sine, cosine);
                    basis[static_cast<size_t>(wave) * cells + i] = unit * cosine;
                }
            }
        }
        int cells;
        std::vector<double> eigenvalue, basis; // basis: one row for each wave, orthonormal
    };

    static void stop_at_walls(Velocity &velocity) {
        for_each_point(velocity.x, [&](int i, int j, int k) {
            if (i == 0 || i == cells_x) velocity.x(i, j, k) = 0;
        });
        for_each_point(velocity.y, [&](int i, int j, int k) {
            if (j == 0 || j == cells_y) velocity.y(i, j, k) = 0;
        });
        for_each_point(velocity.z, [&](int i, int j, int k) {
            if (k == 0 || k == cells_z) velocity.z(i, j, k) = 0;
        });
    }

    // From cells to waves along every axis, or back. The axis that comes first is transformed and becomes the last, so
    // that after three turns the order is the old one.
    void transform(Lattice &p, bool back) const {
        std::vector<double> turned(p.values.size());
        for (const Axis &axis : axes_) {
            const size_t n = static_cast<size_t>(axis.cells), rest = turned.size() / n;
            for (size_t to = 0; to < n; ++to) {
                std::vector<double> sum(rest);
                for (size_t from = 0; from < n; ++from) {
                    const double factor = back ? axis.basis[from * n + to] : axis.basis[to * n + from];
                    const double *row = p.values.data() + from * rest;
                    for (size_t i = 0; i < rest; ++i) sum[i] += factor * row[i];
                }
                for (size_t i = 0; i < rest; ++i) turned[i * n + to] = sum[i];
            }
            std::swap(p.values, turned);
        }
    }

    Axis axes_[3];
};

// ---- The plume

// What a random number is for.
enum Channel : uint32_t {
    channel_draught,
    channel_wander_y,
    channel_wander_z,
    channel_flicker,
    channel_birth,
    channel_radius,
    channel_height,
    channel_angle,
};

class Flow {
  public:
    explicit Flow(uint64_t seed) : seed_(seed) {}

    // One frame further.
    void step() {
        const Traces traces(velocity_);
        for (Lattice *carried : {&temperature_, &velocity_.x, &velocity_.y, &velocity_.z})
            *carried = advect(*carried, traces);
        heat();
        lift();
        confine_vorticity();
        solver_.project(velocity_);
        ++frame_;
    }

    const Velocity &velocity() const { return velocity_; }

  private:
    static constexpr double draught = 0.03;        // cells a frame: unrest of the air at first, of which eddies grow
    static constexpr double heat_radius = 2.1;     // cells
    static constexpr double heat_rate = 0.6;       // share of the source's temperature that its centre takes in a frame
    static constexpr double heat_flicker = 0.3;    // of a temperature of 1
    static constexpr double heat_wander = 1;       // cells, sideways
    static constexpr double heat_frequency = 0.15; // changes of mind a frame
    static constexpr double buoyancy = 0.015;      // cells / frame^2 at a temperature of 1
    static constexpr double confinement =
        0.018; // cells / frame^2 at a curl of 1: keeps alive the eddies that advection wears off
    static constexpr Vec3 heat_centre{3, 0.5 * cells_y, 0.5 * cells_z};

    // In [-1, 1).
    double signed_random(uint64_t number, uint32_t channel) const {
        return 2 * unit_half_open<double>(draw(photon_event(seed_, number), channel)) - 1;
    }

    // Smooth noise in [-1, 1) over time; every channel has its own.
    double noise(uint32_t channel, double time) const {
        const int32_t step = floor_to_int(time);
        const auto value = [&](int32_t at) { return signed_random(static_cast<uint64_t>(at), channel); };
        const double f = time - step, smooth = f * f * f * (f * (f * 6 - 15) + 10);
        return value(step) + smooth * (value(step + 1) - value(step));
    }

    // A warm spot that wanders and flickers, else the plume would stay a straight column.
    void heat() {
        const double time = heat_frequency * frame_;
        const Vec3 centre =
            heat_centre + heat_wander * Vec3(0, noise(channel_wander_y, time), noise(channel_wander_z, time));
        const double warmth = 1 + heat_flicker * noise(channel_flicker, time);
        for_each_point(temperature_, [&](int i, int j, int k) {
            const double r = length(temperature_.point(i, j, k) - centre) / heat_radius;
            if (r >= 1) return;
            const double inside = (1 - r * r) * (1 - r * r);
            temperature_(i, j, k) += heat_rate * inside * (warmth - temperature_(i, j, k));
        });
    }

    void lift() {
        for_each_point(temperature_, [&](int i, int j, int k) {
            if (i > 0) velocity_.x(i, j, k) += buoyancy * 0.5 * (temperature_(i, j, k) + temperature_(i - 1, j, k));
        });
    }

    // A force that winds round the centres of eddies: N x curl, N = grad |curl| / |grad |curl|| (Fedkiw et al. 2001).
    void confine_vorticity() {
        const Lattice &cell = temperature_;
        const size_t dx = cell.index(1, 0, 0), dy = cell.index(0, 1, 0), dz = 1;
        std::vector<Vec3> centre(cell.values.size()), curl(centre.size()), force(centre.size());
        std::vector<double> strength(centre.size());
        for_each_point(cell, [&](int i, int j, int k) { centre[cell.index(i, j, k)] = velocity_.at_centre(i, j, k); });
        const auto for_each_inner_cell = [&](auto action) {
            for (int i = 1; i < cells_x - 1; ++i)
                for (int j = 1; j < cells_y - 1; ++j)
                    for (int k = 1; k < cells_z - 1; ++k) action(cell.index(i, j, k));
        };
        for_each_inner_cell([&](size_t c) {
            const Vec3 x = centre[c + dx] - centre[c - dx], y = centre[c + dy] - centre[c - dy],
                       z = centre[c + dz] - centre[c - dz];
            curl[c] = 0.5 * Vec3(y.z - z.y, z.x - x.z, x.y - y.x);
            strength[c] = length(curl[c]);
        });
        for_each_inner_cell([&](size_t c) {
            const Vec3 gradient(strength[c + dx] - strength[c - dx], strength[c + dy] - strength[c - dy],
                                strength[c + dz] - strength[c - dz]);
            constexpr double tiny = 1e-9; // still air has no direction
            const Vec3 n = gradient / (length(gradient) + tiny), w = curl[c];
            force[c] = confinement * Vec3(n.y * w.z - n.z * w.y, n.z * w.x - n.x * w.z, n.x * w.y - n.y * w.x);
        });
        for (int i = 1; i < cells_x; ++i)
            for (int j = 1; j < cells_y; ++j)
                for (int k = 1; k < cells_z; ++k) {
                    const size_t c = cell.index(i, j, k);
                    velocity_.x(i, j, k) += 0.5 * (force[c].x + force[c - dx].x);
                    velocity_.y(i, j, k) += 0.5 * (force[c].y + force[c - dy].y);
                    velocity_.z(i, j, k) += 0.5 * (force[c].z + force[c - dz].z);
                }
    }

    uint64_t seed_;
    int frame_ = 0;
    Velocity velocity_;
    Lattice temperature_{cells_x, cells_y, cells_z, Vec3(0.5)}; // 0: that of the room
    PressureSolver solver_;
};

} // namespace wisp::plume
