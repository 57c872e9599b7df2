// The point tree beside nanoflann and beside a plain cell list, on one thread: build, k nearest, radius, SPH sums.
//
//   point_tree [FILE...]      each FILE holds points as raw little-endian float32 x y z; without, two made-up plumes
//
// Compile it once per arithmetic, together with src/core/point_tree.cpp, both with the flags of the core. nanoflann gets
// the same flags, float coordinates in f32 and double ones otherwise, the points in the order of our tree, and result
// sets written for it here, so that it neither allocates nor sorts. Times are medians of alternating runs, in ns a query
// (ms for build); `ratio` is the best rival's time over ours. Results are compared before anything is timed.
#include "wisp/kernel.h"
#include "wisp/point_tree.h"
#include "wisp/random.h"
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <nanoflann.hpp>
#include <numeric>
#include <string>
#include <vector>

namespace wisp::WISP_ARITH {
namespace {

using Peer = std::conditional_t<std::is_same_v<Real, float>, float, double>; // nanoflann's and the cell list's scalar

Peer to_peer(float x) { return static_cast<Peer>(x); }
Peer to_peer(double x) { return static_cast<Peer>(x); }
Peer to_peer(Fixed x) { return static_cast<Peer>(std::ldexp(static_cast<double>(x.raw()), -32)); }

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

#ifndef CL
#define CL 8
#endif
constexpr int32_t cell_lanes = CL;

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

WISP_WIDE Peer sum_by_cells(const CellList &cells, const PeerPoint &at, Peer inverse_h) {
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
                WISP_LANES for (int32_t l = 0; l < cell_lanes; ++l) {
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

WISP_WIDE Real sum_by_tree(const PointTree &tree, const Vec3 &at, Real support, Real inverse_h_squared) {
    Real sum[lanes] = {};
    for_each_leaf_near(tree, at, support, [&](uint32_t leaf) {
        for (uint32_t first = leaf * leaf_points; first < (leaf + 1) * leaf_points; first += lanes)
            for (uint32_t l = 0; l < lanes; ++l) {
                const size_t i = size_t{first} + l;
                const Real dx = tree.x[i] - at.x, dy = tree.y[i] - at.y, dz = tree.z[i] - at.z;
                sum[l] += Spline::value(sum_of_products(dx, dx, dy, dy, dz, dz) * inverse_h_squared);
            }
    });
    return ((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7]));
}

// ---- measuring ------------------------------------------------------------------------------------------------------

using Clock = std::chrono::steady_clock;

struct Way {
    const char *name;
    std::function<void()> run;
};

// The medians of the ways' times in seconds; the ways take turns.
std::vector<double> race(const std::vector<Way> &ways) {
    constexpr int runs = 5;
    std::vector<std::vector<double>> times(ways.size());
    for (int run = 0; run <= runs; ++run)
        for (size_t i = 0; i < ways.size(); ++i) {
            const auto start = Clock::now();
            ways[i].run();
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

// ways[0] is ours.
void report(const std::string &set, const char *order, const char *what, double scale, const std::vector<Way> &ways) {
    const std::vector<double> seconds = race(ways);
    const double best = *std::min_element(seconds.begin() + 1, seconds.end());
    for (size_t i = 0; i < ways.size(); ++i)
        std::printf("%s,%s,%s,%s,%s,%.4g,%.3g\n", set.c_str(), WISP_ARITH_NAME, what, order, ways[i].name,
                    seconds[i] * scale, (i == 0 ? best : seconds[i]) / seconds[0]);
    std::fflush(stdout);
}

void require(bool equal, const char *what) {
    if (equal) return;
    std::fprintf(stderr, "%s: results differ\n", what);
    std::exit(1);
}

volatile double sink; // what is summed here is not optimised away

void measure(const std::string &set, const std::vector<Vec3> &points) {
    const uint32_t count = static_cast<uint32_t>(points.size());
    constexpr uint32_t most = 500;
    std::vector<unsigned char> memory(2 * point_tree_bytes(count) + (1 << 20));
    Arena arena(memory.data(), memory.size());
    const PointTree tree = build_point_tree(points.data(), count, arena);
    NearestScratch scratch;
    require(tree.ready && make_nearest_scratch(most, arena, scratch), "memory");

    std::vector<Vec3> ordered(count);
    Cloud cloud;
    for (uint32_t slot = 0; slot < count; ++slot) {
        ordered[slot] = Vec3(tree.x[slot], tree.y[slot], tree.z[slot]);
        cloud.points.push_back(to_peer(ordered[slot]));
    }
    report(set, "tree", "build ms", 1e3,
           {{"wisp",
             [&] {
                 const size_t mark = arena.mark();
                 sink = build_point_tree(ordered.data(), count, arena).count;
                 arena.rewind(mark);
             }},
            {"nanoflann leaf 10", [&] { PeerTree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10)); }},
            {"nanoflann leaf 20", [&] { PeerTree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(20)); }},
            {"nanoflann leaf 40", [&] { PeerTree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(40)); }}});
    Cloud shuffled;
    for (const Vec3 &p : points) shuffled.points.push_back(to_peer(p));
    report(set, "random", "build ms", 1e3,
           {{"wisp",
             [&] {
                 const size_t mark = arena.mark();
                 sink = build_point_tree(points.data(), count, arena).count;
                 arena.rewind(mark);
             }},
            {"nanoflann leaf 10", [&] { PeerTree(3, shuffled, nanoflann::KDTreeSingleIndexAdaptorParams(10)); }},
            {"nanoflann leaf 20", [&] { PeerTree(3, shuffled, nanoflann::KDTreeSingleIndexAdaptorParams(20)); }},
            {"nanoflann leaf 40", [&] { PeerTree(3, shuffled, nanoflann::KDTreeSingleIndexAdaptorParams(40)); }}});

    const PeerTree peer10(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));
    const PeerTree peer20(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(20));
    const PeerTree peer40(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(40));
    struct Peers {
        const PeerTree *tree;
        const char *leaf;
    };

    // Queries: points of the set, moved a little.
    Mt19937 random(1, 2, 3, 4);
    const double jitter = 0.02 * to_peer(length(tree.bounds.high - tree.bounds.low)) / std::cbrt(count);
    std::vector<Vec3> near_order;
    for (uint32_t i = 0; i < 20000; ++i) {
        const Vec3 &p = ordered[static_cast<uint64_t>(i) * count / 20000];
        const double x = normal(random), y = normal(random), z = normal(random);
        near_order.push_back(p + Vec3(to_real<Real>(x * jitter), to_real<Real>(y * jitter), to_real<Real>(z * jitter)));
    }
    std::vector<Vec3> random_order = near_order;
    for (size_t i = random_order.size(); i > 1; --i) std::swap(random_order[i - 1], random_order[random() % i]);

    // The radius that holds `wanted` points on average.
    const auto radius_for = [&](double wanted) {
        double low = 0, high = to_peer(length(tree.bounds.high - tree.bounds.low));
        for (int step = 0; step < 30; ++step) {
            const double middle = 0.5 * (low + high);
            uint64_t found = 0, asked = 0;
            for (size_t i = 0; i < near_order.size(); i += 40, ++asked) {
                found += in_radius(tree, near_order[i], to_real<Real>(middle), nullptr, 0);
                if (static_cast<double>(found) > wanted * 500) break;
            }
            (static_cast<double>(found) > wanted * static_cast<double>(asked) ? high : low) = middle;
        }
        return to_real<Real>(high);
    };
    const Real radius27 = radius_for(27), radius64 = radius_for(64);
    const Peer everywhere = std::numeric_limits<Peer>::max();
    const Real unlimited = Real(20000);

    for (const auto *queries : {&near_order, &random_order}) {
        const char *order = queries == &near_order ? "tree" : "random";
        const double per_query = 1e9 / static_cast<double>(queries->size());
        std::vector<PeerPoint> peer_queries;
        for (const Vec3 &q : *queries) peer_queries.push_back(to_peer(q));

        for (uint32_t k : {64u, 500u}) {
            std::vector<uint32_t> slots(most), found_ids(most);
            std::vector<Real> distances(most);
            std::vector<Peer> peer_distances(most);
            std::vector<std::pair<Peer, uint32_t>> heap;
            heap.reserve(most);
            for (size_t i = 0; i < queries->size(); i += 37) {
                const Nearest found =
                    nearest(tree, (*queries)[i], k, unlimited, scratch, slots.data(), distances.data());
                HeapSet set(heap, k, everywhere);
                peer10.findNeighbors(set, &peer_queries[i].x, nanoflann::SearchParams());
                std::vector<Peer> ours, theirs;
                for (uint32_t n = 0; n < found.count; ++n) ours.push_back(to_peer(distances[n]));
                for (const auto &entry : heap) theirs.push_back(entry.first);
                std::sort(ours.begin(), ours.end()), std::sort(theirs.begin(), theirs.end());
                if (std::is_same_v<Real, Fixed>)
                    for (size_t n = 0; n < ours.size(); ++n) ours[n] = std::abs(ours[n] - theirs[n]) < 1e-8 ? theirs[n] : -1;
                require(ours == theirs, "nearest");
            }
            std::vector<Way> ways = {{"wisp", [&] {
                                          uint64_t sum = 0;
                                          for (const Vec3 &q : *queries)
                                              sum += nearest(tree, q, k, unlimited, scratch, slots.data(),
                                                             distances.data()).farthest;
                                          sink = static_cast<double>(sum);
                                      }}};
            for (const Peers &peer : {Peers{&peer10, "10"}, {&peer20, "20"}, {&peer40, "40"}}) {
                ways.push_back({peer.leaf[0] == '1'   ? "nanoflann leaf 10 heap"
                                : peer.leaf[0] == '2' ? "nanoflann leaf 20 heap"
                                                      : "nanoflann leaf 40 heap",
                                [&, peer] {
                                    double sum = 0;
                                    for (const PeerPoint &q : peer_queries) {
                                        HeapSet set(heap, k, everywhere);
                                        peer.tree->findNeighbors(set, &q.x, nanoflann::SearchParams());
                                        sum += set.worstDist();
                                    }
                                    sink = sum;
                                }});
            }
            ways.push_back({"nanoflann leaf 10 own set", [&] {
                                double sum = 0;
                                for (const PeerPoint &q : peer_queries) {
                                    nanoflann::KNNResultSet<Peer, uint32_t, uint32_t> set(k);
                                    set.init(found_ids.data(), peer_distances.data());
                                    peer10.findNeighbors(set, &q.x, nanoflann::SearchParams());
                                    sum += set.worstDist();
                                }
                                sink = sum;
                            }});
            report(set, order, k == 64 ? "64-NN ns" : "500-NN ns", per_query, ways);
        }

        for (const Real radius : {radius27, radius64}) {
            const auto peer_count = [&](const PeerTree &peer, const PeerPoint &q) {
                uint32_t found = 0;
                visit_radius(peer, q, to_peer(radius), [&](Peer) { ++found; });
                return found;
            };
            for (size_t i = 0; i < queries->size(); i += 37)
                require(std::is_same_v<Real, Fixed> || in_radius(tree, (*queries)[i], radius, nullptr, 0) ==
                                                           peer_count(peer10, peer_queries[i]), "radius");
            std::vector<Way> ways = {{"wisp", [&] {
                                          uint64_t sum = 0;
                                          for (const Vec3 &q : *queries) sum += in_radius(tree, q, radius, nullptr, 0);
                                          sink = static_cast<double>(sum);
                                      }}};
            for (const PeerTree *peer : {&peer10, &peer20, &peer40})
                ways.push_back({peer == &peer10   ? "nanoflann leaf 10"
                                : peer == &peer20 ? "nanoflann leaf 20"
                                                  : "nanoflann leaf 40",
                                [&, peer] {
                                    uint64_t sum = 0;
                                    for (const PeerPoint &q : peer_queries) sum += peer_count(*peer, q);
                                    sink = static_cast<double>(sum);
                                }});
            report(set, order, radius == radius27 ? "radius 27 ns" : "radius 64 ns", per_query, ways);
        }

        const Peer inverse_h = 2 / to_peer(radius64);
        const Real inverse_h2 = to_real<Real>(static_cast<double>(inverse_h) * inverse_h);
        const CellList cells(cloud.points, to_peer(radius64));
        const auto peer_sum = [&](const PeerTree &peer, const PeerPoint &q) {
            Peer sum = 0;
            visit_radius(peer, q, to_peer(radius64), [&](Peer d) { sum += spline(d, inverse_h); });
            return sum;
        };
        for (size_t i = 0; i < queries->size(); i += 37) {
            const double ours = to_peer(sum_by_tree(tree, (*queries)[i], radius64, inverse_h2));
            const double cell_sum = sum_by_cells(cells, peer_queries[i], inverse_h);
            require(std::abs(ours - cell_sum) <= 2e-5 * (1 + cell_sum), "cell list");
            require(std::abs(ours - peer_sum(peer10, peer_queries[i])) <= 2e-5 * (1 + cell_sum), "nanoflann's sum");
        }
        report(set, order, "SPH sum 64 ns", per_query,
               {{"wisp",
                 [&] {
                     double sum = 0;
                     for (const Vec3 &q : *queries) sum += to_peer(sum_by_tree(tree, q, radius64, inverse_h2));
                     sink = sum;
                 }},
                {"cell list",
                 [&] {
                     double sum = 0;
                     for (const PeerPoint &q : peer_queries) sum += sum_by_cells(cells, q, inverse_h);
                     sink = sum;
                 }},
                {"nanoflann leaf 10", [&] {
                     double sum = 0;
                     for (const PeerPoint &q : peer_queries) sum += peer_sum(peer10, q);
                     sink = sum;
                 }}});
    }
}

} // namespace

int run(int count, char **words) {
    std::printf("set,arithmetic,what,queries,way,time,ratio\n");
    for (int i = 1; i < count; ++i) measure(words[i], read_points(words[i]));
    if (count == 1) {
        measure("plume 110401", plume(110401));
        measure("plume 640000", plume(640000));
    }
    return 0;
}

} // namespace wisp::WISP_ARITH

int main(int count, char **words) { return wisp::WISP_ARITH::run(count, words); }
