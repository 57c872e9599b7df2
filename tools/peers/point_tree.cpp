// The point tree beside nanoflann and beside a plain cell list, on one thread: build, k nearest, radius, SPH sums.
//
//   point_tree [FILE...]      each FILE holds points as raw little-endian float32 x y z; without any, the points are
//                             two made-up plumes and a cube filled evenly
//
// Compile it once per arithmetic, together with src/core/geometry/point_kdtree.cpp, everything with the flags of the
// core and one -march (-O3 -march=x86-64-v3). nanoflann gets float coordinates in f32 and double ones otherwise, the
// points in the order of our tree, and result sets written for it here, so that it neither allocates nor sorts. Times
// are medians of alternating runs, in ns a query (ms for build); `ratio` is a rival's time over ours, and in our own
// line that of the best rival. Results are compared before anything is timed.
#include "core/geometry/point_kdtree.h"
#include "core/numbers/random.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <nanoflann.hpp>
#include <numeric>
#include <string>
#include <vector>

namespace wisp::WISP_ARITH {
namespace {

using Peer = std::conditional_t<std::is_same_v<Real, float>, float, double>; // nanoflann's and the cell list's scalar

Peer to_peer(Real x) { return static_cast<Peer>(to_double(x)); }

struct PeerPoint {
    Peer x, y, z;
};

PeerPoint to_peer(const Vec3 &p) { return {to_peer(p.x), to_peer(p.y), to_peer(p.z)}; }

// ---- points ---------------------------------------------------------------------------------------------------------

double unit(Mt19937 &random) { return random() * 0x1p-32; }

double normal(Mt19937 &random) {
    const double u = 1 - unit(random), v = unit(random);
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * 3.14159265358979323846 * v);
}

// Vortex rings that rise, drift and spread: dense thin cores, wide thin clouds.
std::vector<Vec3> plume(uint32_t count) {
    Mt19937 random(275, 0, 0, 0);
    struct Ring {
        double x, y, z, radius, core, tilt_x, tilt_y;
    };
    std::vector<Ring> rings;
    double x = 0, y = 0;
    for (int i = 0; i < 90; ++i) {
        const double age = (i + 1) / 90.0;
        x += 0.25 * normal(random), y += 0.25 * normal(random);
        rings.push_back({x, y, 40 * age, 0.5 + 4 * age * unit(random), 0.05 + 1.2 * age * age * unit(random),
                         0.4 * normal(random), 0.4 * normal(random)});
    }
    std::vector<Vec3> points(count);
    for (Vec3 &p : points) {
        const Ring &ring = rings[random() % rings.size()];
        const double turn = 2 * 3.14159265358979323846 * unit(random);
        const double px = ring.radius * std::cos(turn) + ring.core * normal(random);
        const double py = ring.radius * std::sin(turn) + ring.core * normal(random);
        const double pz = ring.tilt_x * px + ring.tilt_y * py + ring.core * normal(random);
        p = Vec3(to_real<Real>(ring.x + px), to_real<Real>(ring.y + py), to_real<Real>(ring.z - 20 + pz));
    }
    return points;
}

std::vector<Vec3> cube(uint32_t count) {
    Mt19937 random(1, 0, 0, 0);
    std::vector<Vec3> points(count);
    for (Vec3 &p : points) {
        const double x = unit(random), y = unit(random), z = unit(random);
        p = Vec3(to_real<Real>(20 * x - 10), to_real<Real>(20 * y - 10), to_real<Real>(20 * z - 10));
    }
    return points;
}

std::vector<Vec3> read_points(const char *name) {
    std::vector<Vec3> points;
    std::FILE *file = std::fopen(name, "rb");
    if (!file) {
        std::fprintf(stderr, "%s: cannot be opened\n", name);
        std::exit(1);
    }
    float xyz[3];
    while (std::fread(xyz, sizeof(float), 3, file) == 3)
        points.push_back(Vec3(to_real<Real>(xyz[0]), to_real<Real>(xyz[1]), to_real<Real>(xyz[2])));
    std::fclose(file);
    return points;
}

// ---- nanoflann ------------------------------------------------------------------------------------------------------

struct Cloud {
    std::vector<PeerPoint> points;
    size_t kdtree_get_point_count() const { return points.size(); }
    Peer kdtree_get_pt(uint32_t i, size_t axis) const {
        return axis == 0 ? points[i].x : axis == 1 ? points[i].y : points[i].z;
    }
    template <class Bounds> bool kdtree_get_bbox(Bounds &) const { return false; }
};

using PeerTree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<Peer, Cloud>, Cloud, 3, uint32_t>;

// The k nearest in a binary max-heap: nanoflann's own KNNResultSet inserts into a sorted array.
class HeapSet {
  public:
    using DistanceType = Peer;
    HeapSet(std::vector<std::pair<Peer, uint32_t>> &heap, size_t k, Peer limit) : heap_(heap), k_(k), limit_(limit) {
        heap_.clear();
    }
    size_t size() const { return heap_.size(); }
    bool full() const { return heap_.size() == k_; }
    Peer worstDist() const { return full() ? heap_.front().first : limit_; }
    bool addPoint(Peer distance, uint32_t index) {
        if (!full()) {
            if (!(distance < limit_)) return true;
            heap_.emplace_back(distance, index);
            std::push_heap(heap_.begin(), heap_.end());
        } else if (distance < heap_.front().first) {
            replace_top({distance, index});
        }
        return true;
    }

  private:
    void replace_top(std::pair<Peer, uint32_t> entry) {
        size_t at = 0;
        for (size_t child = 1; child < k_; child = 2 * at + 1) {
            if (child + 1 < k_ && heap_[child] < heap_[child + 1]) ++child;
            if (!(entry < heap_[child])) break;
            heap_[at] = heap_[child];
            at = child;
        }
        heap_[at] = entry;
    }
    std::vector<std::pair<Peer, uint32_t>> &heap_;
    size_t k_;
    Peer limit_;
};

// Hands each point within the radius to a function.
template <class Visit> class VisitSet {
  public:
    using DistanceType = Peer;
    VisitSet(Peer radius_squared, Visit &visit) : radius_squared_(radius_squared), visit_(visit) {}
    size_t size() const { return 0; }
    bool full() const { return true; }
    Peer worstDist() const { return radius_squared_; }
    bool addPoint(Peer distance, uint32_t) {
        if (distance < radius_squared_) visit_(distance);
        return true;
    }

  private:
    Peer radius_squared_;
    Visit &visit_;
};

template <class Visit> void visit_radius(const PeerTree &tree, const PeerPoint &at, Peer radius, Visit &&visit) {
    VisitSet<std::remove_reference_t<Visit>> set(radius * radius, visit);
    const Peer query[3] = {at.x, at.y, at.z};
    tree.findNeighbors(set, query, nanoflann::SearchParams());
}

// ---- SPH sums: sum_i (2 - r / h)^3 ----------------------------------------------------------------------------------

inline Peer spline(Peer distance_squared, Peer inverse_h) {
    const Peer u = max(Peer(0), 2 - inverse_h * sqrt(distance_squared));
    return u * u * u;
}

constexpr int32_t cell_lanes = 8;

// Points sorted into cells of the support's size, x fastest: the 27 cells around a point are nine runs.
struct CellList {
    Peer low_x, low_y, low_z, inverse_edge;
    int32_t nx, ny, nz;
    std::vector<uint32_t> first;
    std::vector<Peer> x, y, z;

    CellList(const std::vector<PeerPoint> &points, Peer edge) : inverse_edge(1 / edge) {
        PeerPoint low = points[0], high = points[0];
        for (const PeerPoint &p : points) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        // One empty layer around, so that no run leaves the grid.
        low_x = low.x - edge, low_y = low.y - edge, low_z = low.z - edge;
        nx = cell(high.x, low_x) + 2, ny = cell(high.y, low_y) + 2, nz = cell(high.z, low_z) + 2;
        first.assign(static_cast<size_t>(nx) * ny * nz + 1, 0);
        for (const PeerPoint &p : points) ++first[index(p) + 1];
        std::partial_sum(first.begin(), first.end(), first.begin());
        std::vector<uint32_t> next(first.begin(), first.end() - 1);
        x.resize(points.size() + cell_lanes), y = z = x;
        for (const PeerPoint &p : points) {
            const uint32_t slot = next[index(p)]++;
            x[slot] = p.x, y[slot] = p.y, z[slot] = p.z;
        }
    }
    int32_t cell(Peer at, Peer low) const { return static_cast<int32_t>((at - low) * inverse_edge); }
    size_t index(int32_t i, int32_t j, int32_t k) const { return (static_cast<size_t>(k) * ny + j) * nx + i; }
    size_t index(const PeerPoint &p) const { return index(cell(p.x, low_x), cell(p.y, low_y), cell(p.z, low_z)); }
};

WISP_MULTIVERSIONED Peer sum_by_cells(const CellList &cells, const PeerPoint &at, Peer inverse_h) {
    const auto clamped = [](int32_t c, int32_t n) { return min(max(c, 1), n - 2); };
    const int32_t i = clamped(cells.cell(at.x, cells.low_x), cells.nx);
    const int32_t j = clamped(cells.cell(at.y, cells.low_y), cells.ny);
    const int32_t k = clamped(cells.cell(at.z, cells.low_z), cells.nz);
    const Peer *x = cells.x.data(), *y = cells.y.data(), *z = cells.z.data();
    Peer sum[cell_lanes] = {};
    for (int32_t dk = -1; dk <= 1; ++dk)
        for (int32_t dj = -1; dj <= 1; ++dj) {
            const size_t run = cells.index(i - 1, j + dj, k + dk);
            const size_t begin = cells.first[run], end = cells.first[run + 3];
            for (size_t s = begin; s < end; s += cell_lanes) {
                const int32_t left = static_cast<int32_t>(end - s);
                WISP_NO_UNROLL for (int32_t l = 0; l < cell_lanes; ++l) {
                    const Peer dx = x[s + l] - at.x, dy = y[s + l] - at.y, dz = z[s + l] - at.z;
                    const Peer value = spline(dx * dx + dy * dy + dz * dz, inverse_h);
                    sum[l] += l < left ? value : 0;
                }
            }
        }
    Peer total = 0;
    for (int32_t l = 0; l < cell_lanes; ++l) total += sum[l];
    return total;
}

WISP_MULTIVERSIONED Real sum_by_tree(const PointTree &tree, const Vec3 &at, Real support, Real inverse_h_squared) {
    Real sum[lanes] = {};
    for_each_leaf_near(tree, at, support, [&](uint32_t leaf) {
        for (size_t first = size_t{leaf} * leaf_points; first < (size_t{leaf} + 1) * leaf_points; first += lanes)
            WISP_NO_UNROLL for (uint32_t l = 0; l < lanes; ++l) {
                const size_t i = first + l;
                const Real dx = tree.x[i] - at.x, dy = tree.y[i] - at.y, dz = tree.z[i] - at.z;
                const Real q_squared = sum_of_products(dx, dx, dy, dy, dz, dz) * inverse_h_squared;
                const Real u = Real(2) - sqrt(min(q_squared, Real(4)));
                sum[l] += u * u * u;
            }
    });
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

// ---- measuring ------------------------------------------------------------------------------------------------------

using Clock = std::chrono::steady_clock;

struct Candidate {
    std::string name;
    std::function<void()> run;
};

// The median time of each candidate in seconds; the candidates take turns.
std::vector<double> race(const std::vector<Candidate> &candidates) {
    constexpr int runs = 5;
    std::vector<std::vector<double>> times(candidates.size());
    for (int run = 0; run <= runs; ++run)
        for (size_t i = 0; i < candidates.size(); ++i) {
            const auto start = Clock::now();
            candidates[i].run();
            const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
            if (run > 0) times[i].push_back(seconds); // the first run warms up
        }
    std::vector<double> medians;
    for (auto &t : times) {
        std::sort(t.begin(), t.end());
        medians.push_back(t[runs / 2]);
    }
    return medians;
}

void require(bool equal, const char *what) {
    if (equal) return;
    std::fprintf(stderr, "%s: results differ\n", what);
    std::exit(1);
}

volatile double sink; // what is summed here is not optimised away

// nanoflann works in double beside Fixed; otherwise distances are the same bits.
constexpr double tolerance = std::is_same_v<Real, Fixed> ? 1e-8 : 0;

// Everything that the rows of one point set need.
struct Bench {
    std::string name;
    const std::vector<Vec3> &points;
    std::vector<unsigned char> memory;
    Arena arena;
    PointTree tree;
    NearestScratch scratch;
    std::vector<Vec3> ordered; // by slot
    Cloud cloud, unordered;    // the same for nanoflann, and in the order of `points`
    std::vector<std::unique_ptr<PeerTree>> peers;
    Real radius27, radius64; // these hold so many points on average

    Bench(const std::string &set_name, const std::vector<Vec3> &set_points);
    void all();

  private:
    struct Queries {
        const char *order;
        std::vector<Vec3> ours;
        std::vector<PeerPoint> theirs;
    };
    static constexpr uint32_t most = 500;
    static constexpr size_t compared_every = 37;
    static constexpr const char *peer_names[3] = {"nanoflann leaf 10", "nanoflann leaf 20", "nanoflann leaf 40"};
    static constexpr size_t peer_leaves[3] = {10, 20, 40};

    std::vector<Vec3> make_queries() const;
    Real radius_for(const std::vector<Vec3> &queries, double wanted) const;
    void build_row(const char *order, const std::vector<Vec3> &in, const Cloud &peer_in);
    void nearest_row(const Queries &queries, uint32_t k);
    void radius_row(const Queries &queries, const char *what, Real radius);
    void sum_row(const Queries &queries);
    void report(const char *order, const std::string &what, double scale,
                const std::vector<Candidate> &candidates) const;
};

Bench::Bench(const std::string &set_name, const std::vector<Vec3> &set_points)
    : name(set_name), points(set_points),
      memory(static_cast<size_t>(2 * point_tree_bytes(static_cast<uint32_t>(points.size())) +
                                 nearest_scratch_bytes(most))),
      arena(memory.data(), memory.size()) {
    const uint32_t count = static_cast<uint32_t>(points.size());
    tree = build_point_tree(points.data(), count, arena);
    require(tree.ready && make_nearest_scratch(most, arena, scratch), "memory");
    for (uint32_t slot = 0; slot < count; ++slot) {
        ordered.push_back(Vec3(tree.x[slot], tree.y[slot], tree.z[slot]));
        cloud.points.push_back(to_peer(ordered.back()));
    }
    for (const Vec3 &p : points) unordered.points.push_back(to_peer(p));
    for (const size_t leaf : peer_leaves)
        peers.push_back(std::make_unique<PeerTree>(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(leaf)));
}

// Points of the set, moved a little, in the order of the tree.
std::vector<Vec3> Bench::make_queries() const {
    constexpr uint32_t queries = 8000;
    Mt19937 random(1, 2, 3, 4);
    const double jitter = 0.02 * to_double(length(tree.bounds.high - tree.bounds.low)) / std::cbrt(tree.count);
    std::vector<Vec3> result;
    for (uint64_t i = 0; i < queries; ++i) {
        const double x = normal(random), y = normal(random), z = normal(random);
        result.push_back(ordered[i * tree.count / queries] +
                         Vec3(to_real<Real>(x * jitter), to_real<Real>(y * jitter), to_real<Real>(z * jitter)));
    }
    return result;
}

Real Bench::radius_for(const std::vector<Vec3> &queries, double wanted) const {
    double low = 0, high = to_double(length(tree.bounds.high - tree.bounds.low));
    for (int step = 0; step < 30; ++step) {
        const double middle = 0.5 * (low + high);
        double found = 0, sampled = 0;
        for (size_t i = 0; i < queries.size(); i += 40) sampled += 1;
        for (size_t i = 0; i < queries.size() && found <= wanted * sampled; i += 40)
            found += in_radius(tree, queries[i], to_real<Real>(middle), nullptr, 0);
        (found > wanted * sampled ? high : low) = middle;
    }
    return to_real<Real>(high);
}

// candidates[0] is ours.
void Bench::report(const char *order, const std::string &what, double scale,
                   const std::vector<Candidate> &candidates) const {
    const std::vector<double> seconds = race(candidates);
    const double best = *std::min_element(seconds.begin() + 1, seconds.end());
    for (size_t i = 0; i < candidates.size(); ++i)
        std::printf("%s,%s,%s,%s,%s,%.4g,%.3g\n", name.c_str(), WISP_ARITH_NAME, what.c_str(), order,
                    candidates[i].name.c_str(), seconds[i] * scale, (i == 0 ? best : seconds[i]) / seconds[0]);
    std::fflush(stdout);
}

void Bench::build_row(const char *order, const std::vector<Vec3> &in, const Cloud &peer_in) {
    std::vector<Candidate> candidates = {{"wisp", [&] {
                                              const size_t mark = arena.mark();
                                              require(build_point_tree(in.data(), tree.count, arena).ready, "memory");
                                              arena.rewind(mark);
                                          }}};
    for (size_t i = 0; i < peers.size(); ++i)
        candidates.push_back({peer_names[i], [&, i] {
                                  PeerTree(3, peer_in, nanoflann::KDTreeSingleIndexAdaptorParams(peer_leaves[i]));
                              }});
    report(order, "build ms", 1e3, candidates);
}

void Bench::nearest_row(const Queries &queries, uint32_t k) {
    constexpr Peer everywhere = std::numeric_limits<Peer>::max();
    const Real unlimited(20000);
    std::vector<uint32_t> slots(k), peer_ids(k);
    std::vector<Real> distances(k);
    std::vector<Peer> peer_distances(k);
    std::vector<std::pair<Peer, uint32_t>> heap;
    heap.reserve(k);
    const auto search = [&](const Vec3 &q) {
        return nearest(tree, q, k, unlimited, scratch, slots.data(), distances.data());
    };
    for (size_t i = 0; i < queries.ours.size(); i += compared_every) {
        const uint32_t found = search(queries.ours[i]).count;
        HeapSet result(heap, k, everywhere);
        peers[0]->findNeighbors(result, &queries.theirs[i].x, nanoflann::SearchParams());
        std::sort_heap(heap.begin(), heap.end());
        std::sort(distances.begin(), distances.begin() + found);
        require(found == heap.size(), "nearest");
        for (uint32_t n = 0; n < found; ++n)
            require(std::abs(to_peer(distances[n]) - heap[n].first) <= tolerance, "nearest");
    }
    std::vector<Candidate> candidates = {{"wisp", [&] {
                                              uint64_t sum = 0;
                                              for (const Vec3 &q : queries.ours) sum += search(q).farthest;
                                              sink = static_cast<double>(sum);
                                          }}};
    for (size_t i = 0; i < peers.size(); ++i)
        candidates.push_back({std::string(peer_names[i]) + " heap", [&, i] {
                                  double sum = 0;
                                  for (const PeerPoint &q : queries.theirs) {
                                      HeapSet result(heap, k, everywhere);
                                      peers[i]->findNeighbors(result, &q.x, nanoflann::SearchParams());
                                      sum += static_cast<double>(result.worstDist());
                                  }
                                  sink = sum;
                              }});
    candidates.push_back({"nanoflann leaf 10 KNNResultSet", [&] {
                              double sum = 0;
                              for (const PeerPoint &q : queries.theirs) {
                                  nanoflann::KNNResultSet<Peer, uint32_t, uint32_t> result(k);
                                  result.init(peer_ids.data(), peer_distances.data());
                                  peers[0]->findNeighbors(result, &q.x, nanoflann::SearchParams());
                                  sum += static_cast<double>(result.worstDist());
                              }
                              sink = sum;
                          }});
    report(queries.order, std::to_string(k) + "-NN ns", 1e9 / static_cast<double>(queries.ours.size()), candidates);
}

void Bench::radius_row(const Queries &queries, const char *what, Real radius) {
    const auto count_by_peer = [&](const PeerTree &peer, const PeerPoint &q) {
        uint32_t found = 0;
        visit_radius(peer, q, to_peer(radius), [&](Peer) { ++found; });
        return found;
    };
    for (size_t i = 0; i < queries.ours.size() && tolerance == 0; i += compared_every)
        require(in_radius(tree, queries.ours[i], radius, nullptr, 0) == count_by_peer(*peers[0], queries.theirs[i]),
                "radius");
    std::vector<Candidate> candidates = {{"wisp", [&] {
                                              uint64_t sum = 0;
                                              for (const Vec3 &q : queries.ours)
                                                  sum += in_radius(tree, q, radius, nullptr, 0);
                                              sink = static_cast<double>(sum);
                                          }}};
    for (size_t p = 0; p < peers.size(); ++p)
        candidates.push_back({peer_names[p], [&, p] {
                                  uint64_t sum = 0;
                                  for (const PeerPoint &q : queries.theirs) sum += count_by_peer(*peers[p], q);
                                  sink = static_cast<double>(sum);
                              }});
    report(queries.order, what, 1e9 / static_cast<double>(queries.ours.size()), candidates);
}

void Bench::sum_row(const Queries &queries) {
    const Peer inverse_h = 2 / to_peer(radius64);
    const Real inverse_h_squared = to_real<Real>(static_cast<double>(inverse_h) * static_cast<double>(inverse_h));
    const CellList cells(cloud.points, to_peer(radius64));
    const auto sum_by_peer = [&](const PeerTree &peer, const PeerPoint &q) {
        Peer sum = 0;
        visit_radius(peer, q, to_peer(radius64), [&](Peer d) { sum += spline(d, inverse_h); });
        return sum;
    };
    for (size_t i = 0; i < queries.ours.size(); i += compared_every) {
        const double ours = to_double(sum_by_tree(tree, queries.ours[i], radius64, inverse_h_squared));
        const double by_cells = static_cast<double>(sum_by_cells(cells, queries.theirs[i], inverse_h));
        const double by_peer = static_cast<double>(sum_by_peer(*peers[0], queries.theirs[i]));
        require(std::abs(ours - by_cells) <= 2e-5 * (1 + by_cells), "cell list");
        require(std::abs(ours - by_peer) <= 2e-5 * (1 + by_peer), "nanoflann's sums");
    }
    std::vector<Candidate> candidates = {{"wisp",
                                          [&] {
                                              double sum = 0;
                                              for (const Vec3 &q : queries.ours)
                                                  sum += to_double(sum_by_tree(tree, q, radius64, inverse_h_squared));
                                              sink = sum;
                                          }},
                                         {"cell list", [&] {
                                              double sum = 0;
                                              for (const PeerPoint &q : queries.theirs)
                                                  sum += static_cast<double>(sum_by_cells(cells, q, inverse_h));
                                              sink = sum;
                                          }}};
    for (size_t p = 0; p < peers.size(); ++p)
        candidates.push_back({peer_names[p], [&, p] {
                                  double sum = 0;
                                  for (const PeerPoint &q : queries.theirs)
                                      sum += static_cast<double>(sum_by_peer(*peers[p], q));
                                  sink = sum;
                              }});
    report(queries.order, "SPH sum 64 ns", 1e9 / static_cast<double>(queries.ours.size()), candidates);
}

void Bench::all() {
    build_row("tree", ordered, cloud);
    build_row("random", points, unordered);
    Queries queries = {"tree", make_queries(), {}};
    radius27 = radius_for(queries.ours, 27);
    radius64 = radius_for(queries.ours, 64);
    for (int pass = 0; pass < 2; ++pass) {
        if (pass == 1) {
            queries.order = "random";
            Mt19937 random(5, 6, 7, 8);
            for (size_t i = queries.ours.size(); i > 1; --i) std::swap(queries.ours[i - 1], queries.ours[random() % i]);
        }
        queries.theirs.clear();
        for (const Vec3 &q : queries.ours) queries.theirs.push_back(to_peer(q));
        nearest_row(queries, 64);
        nearest_row(queries, 500);
        radius_row(queries, "radius 27 ns", radius27);
        radius_row(queries, "radius 64 ns", radius64);
        sum_row(queries);
    }
}

void measure(const std::string &name, const std::vector<Vec3> &points) { Bench(name, points).all(); }

} // namespace

int run(int count, char **words) {
    std::printf("set,arithmetic,what,queries,way,time,ratio\n");
    for (int i = 1; i < count; ++i) measure(words[i], read_points(words[i]));
    if (count == 1) {
        measure("plume 110401", plume(110401));
        measure("plume 640000", plume(640000));
        measure("cube 110401", cube(110401));
    }
    return 0;
}

} // namespace wisp::WISP_ARITH

int main(int count, char **words) { return wisp::WISP_ARITH::run(count, words); }
