// Where bricks are, what resampled smoke is held against, and marching through it.
#include "wisp/wisp.h"
#include "support/built_sparse_grid.h"
#include "support/compared_pictures.h"
#include "support/mixture.h"
#include "wisp/settings.h"
#include <array>
#include <cstring>
#include <map>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

bool same_bits(const Vec3 &a, const Vec3 &b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

bool holds(const Box &box, const Vec3 &x) {
    return x.x >= box.low.x && x.y >= box.low.y && x.z >= box.low.z && x.x <= box.high.x && x.y <= box.high.y &&
           x.z <= box.high.z;
}

std::vector<Particle> unlike_sizes(uint32_t count, double extent, double area) {
    std::vector<Particle> particles = cloud(count, extent, 1, area);
    for (size_t i = 0; i < particles.size(); ++i) particles[i].h = 1 + 0.25 * static_cast<double>(i % 5);
    return particles;
}

// All kinds of smoke, apart and together. Each list may be resampled but the last two.
struct Lists {
    Lists() : mixed(unlike_sizes(60, 4, 1)), apart(cloud(6, 14, 1, 1, 5)), sparse(20 * 6 * 11), full(9 * 12 * 5) {
        Sequence next{3};
        for (size_t i = 0; i < sparse.size(); ++i) sparse[i] = i % 20 < 3 || i % 97 == 0 ? float(next()) : 0.0f;
        for (float &d : full) d = float(next());
        const Double3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
        aligned = {20, 6, 11, sparse.data(), 0.7, {0.3, -2, 1}, {10, 3, 5.5}, {x, y, z}};
        GridDescription turned = {9, 12, 5, full.data(), 0.7, {3, -2, 1}, {4.5, 6, 2.5}, {}};
        turned.axis[0] = {0.6, 0.8, 0};
        turned.axis[1] = {-0.8, 0.6, 0};
        turned.axis[2] = z;
        const GridDescription block = {1, 1, 1, nullptr, 0.7, {3, -2, 1}, {4, 6, 3}, {x, y, z}};
        lists = {{smoke_of(mixed)},        {smoke_of(apart, Kernel::poly6), smoke_of(mixed)},
                 {grid_smoke_of(aligned)}, {box_smoke({4, 6, 3}, 0.7, 20)},
                 {grid_smoke_of(turned)},  {smoke_of(apart), grid_smoke_of(turned), grid_smoke_of(block)}};
    }
    std::vector<Particle> mixed, apart;
    std::vector<float> sparse, full;
    GridDescription aligned;
    std::vector<std::vector<SmokeDescription>> lists;
};
constexpr size_t resampled_lists = 4;

} // namespace

TEST_CASE(WISP_ARITH_NAME ": there is a brick wherever there is smoke") {
    const Lists all;
    for (const auto &list : all.lists)
        for (double lengths : {0.3, 1.0}) {
            const BuiltSparseGrid built(list, lengths);
            const BuiltMedium exact(list);
            const SparseGrid &bricks = built.bricks;
            const Vec3 size = bricks.bounds.high - bricks.bounds.low;
            Sequence next{7};
            int met = 0;
            for (int i = 0; i < 8000; ++i) {
                const Vec3 share = vec(1.2 * next() - 0.1, 1.2 * next() - 0.1, 1.2 * next() - 0.1);
                const Vec3 x = bricks.bounds.low + share * size;
                Real sigma = Real(0);
                for (uint32_t s = 0; s < exact.medium.count; ++s) sigma += extinction(exact.medium.smokes[s].field, x);
                if (!(sigma > Real(0))) continue;
                ++met;
                const Cell cell = cell_at(bricks.lattice, x);
                const uint32_t brick = brick_at(bricks, cell);
                if (holds(bricks.bounds, x) && brick != no_brick) {
                    const Vec3 p = position_in(bricks, brick, x);
                    const double past = 1e4 * unit_error;
                    CHECK(holds({vec(-past, -past, -past), vec(8 + past, 8 + past, 8 + past)}, p));
                    continue;
                }
                CAPTURE(lengths);
                CAPTURE(&list - all.lists.data());
                FAIL_CHECK("smoke outside of bricks");
            }
            CHECK(met > 20);
        }
}

TEST_CASE(WISP_ARITH_NAME ": of particles there are no other bricks than those that a support reaches") {
    const std::vector<Particle> particles = cloud(20, 14, 1, 1, 5);
    for (double lengths : {0.3, 0.6}) {
        const BuiltSparseGrid built({smoke_of(particles)}, lengths);
        const Lattice &lattice = built.bricks.lattice;
        for (int32_t z = 0; z < lattice.count.z; ++z)
            for (int32_t y = 0; y < lattice.count.y; ++y)
                for (int32_t x = 0; x < lattice.count.x; ++x) {
                    double nearest = 1e9;
                    for (const Particle &p : particles) {
                        double squares = 0;
                        const double place[3] = {p.position.x, p.position.y, p.position.z};
                        const int32_t cell[3] = {x, y, z};
                        for (int k = 0; k < 3; ++k) {
                            const double low = at(lattice.low[k]) + cell[k] * at(lattice.edge[k]);
                            const double gap = std::max({low - place[k], place[k] - low - at(lattice.edge[k]), 0.0});
                            squares += gap * gap;
                        }
                        nearest = std::min(nearest, std::sqrt(squares));
                    }
                    if (std::fabs(nearest - 2) < 1e-4) continue;
                    CHECK((brick_at(built.bricks, {x, y, z}) != no_brick) == (nearest < 2));
                }
        CHECK(built.bricks.count < number_of(lattice.count) / 2);
    }
}

TEST_CASE(WISP_ARITH_NAME ": bricks take what their plan says, and say so when they have less") {
    const Lists all;
    for (const auto &list : all.lists) {
        const BuiltSparseGrid built(list, 0.6);
        const uint64_t lattice = number_of(built.bricks.lattice.count), count = built.bricks.count;
        CHECK(built.plan.count == count);
        CHECK(built.plan.bytes == lattice * sizeof(uint32_t) + count * sizeof(Cell) + 2 * 64);
        CHECK(at(built.plan.longest) ==
              doctest::Approx(at(length(built.bricks.bounds.high - built.bricks.bounds.low))));
        uint64_t listed = 0;
        for (uint64_t i = 0; i < lattice; ++i) {
            const uint32_t brick = built.bricks.index[i];
            if (brick == no_brick) continue;
            CHECK(brick == listed++);
            CHECK(index_of(built.bricks.lattice.count, built.bricks.position[brick]) == static_cast<int64_t>(i));
        }
        CHECK(listed == count);

        std::vector<unsigned char> memory(built.plan.bytes + 64);
        for (size_t offset : {0, 1, 63}) {
            Arena arena(memory.data() + offset, built.plan.bytes);
            CHECK(make_sparse_grid(built.scene, 0.6, arena).ready);
        }
        const uint64_t least = built.plan.bytes - 2 * 64;
        for (uint64_t bytes : {uint64_t{0}, lattice * sizeof(uint32_t) - 1, lattice * sizeof(uint32_t), least - 1}) {
            Arena arena(memory.data(), bytes);
            CHECK(!make_sparse_grid(built.scene, 0.6, arena).ready);
        }
    }
    const Scene nothing = {};
    Arena none(nullptr, 0);
    CHECK(plan_sparse_grid(nothing, 1).bytes == 0);
    const SparseGrid bricks = make_sparse_grid(nothing, 1, none);
    CHECK(bricks.ready);
    CHECK(bricks.count == 0);
}

TEST_CASE(WISP_ARITH_NAME ": of a lattice too large to count, a plan takes all bricks") {
    const std::vector<Particle> particles = {{{-300, -300, -300}, 1, 1}, {{300, 300, 300}, 1, 1}};
    const BuiltSparseGrid built({smoke_of(particles)}, 0.75);
    const uint64_t lattice = number_of(built.bricks.lattice.count);
    CHECK(lattice > uint64_t{1} << 19);
    CHECK(built.plan.count == lattice);
    CHECK(built.bricks.count <= 16);
}

TEST_CASE(WISP_ARITH_NAME ": smoke that finds no room to be resampled says so") {
    const Lists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 1);
        std::vector<unsigned char> memory(built.memory.size());
        Arena enough(memory.data(), memory.size());
        REQUIRE(make_medium(built.scene, 1, enough).ready);
        CHECK(enough.peak() <= enough.size());
        for (int part = 0; part < 64; ++part) {
            Arena arena(memory.data(), enough.peak() * static_cast<size_t>(part) / 64);
            CHECK(!make_medium(built.scene, 1, arena).ready);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": every brick that holds a node has the same point there, and the same density") {
    const Lists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 0.6);
        const SparseGrid &bricks = built.bricks();
        struct Node {
            Vec3 x;
            std::vector<Real> sigma;
        };
        std::map<std::array<int32_t, 3>, Node> nodes;
        uint64_t again = 0, different = 0;
        for (uint32_t b = 0; b < bricks.count; ++b)
            for (uint32_t k = 0; k < nodes_of(1); ++k) {
                const Cell place = place_of_node(bricks, b, k);
                Node here = {node_of(bricks, b, cell_of_index(nodes_along(1), k)), {}};
                for (uint32_t s = 0; s < built.medium.count; ++s) here.sigma.push_back(built.field(s).nodes(b)[k]);
                const auto found = nodes.insert({{place.x, place.y, place.z}, here});
                if (found.second) continue;
                ++again;
                const Node &before = found.first->second;
                if (!same_bits(before.x, here.x) || before.sigma != here.sigma) ++different;
            }
        CHECK(again > 500);
        CHECK(different == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the holders of a node are all bricks that have it, whichever one is asked") {
    const Lists all;
    Sequence next{9};
    for (double lengths : {0.3, 0.6}) {
        const BuiltSparseGrid built({all.lists[1][0]}, lengths);
        const SparseGrid &bricks = built.bricks;
        for (int32_t stride = 1; stride <= brick_cells; stride *= 2) {
            const int32_t n = nodes_along(stride);
            std::map<std::array<int32_t, 3>, std::vector<std::pair<uint32_t, uint32_t>>> holders;
            for (uint32_t b = 0; b < bricks.count; ++b)
                for (uint32_t k = 0; k < nodes_of(stride); ++k) {
                    const Cell place = place_of_node(bricks, b, k, stride);
                    holders[{place.x, place.y, place.z}].push_back({b, k});
                }
            uint64_t wrong = 0, most = 0, outside = 0;
            for (int round = 0; round < 4000; ++round) {
                const Cell &count = bricks.lattice.count;
                const auto any = [&](int32_t most_) { return static_cast<int32_t>(next() * most_); };
                const Cell place = {any(count.x), any(count.y), any(count.z)};
                // From n - 1 before to n - 1 behind, those at the ends more often.
                const auto node_along = [&] {
                    const int32_t ends[] = {-1, 0, n - 1, n};
                    return any(2) ? ends[any(4)] : any(3 * n - 2) - (n - 1);
                };
                const Cell node = {node_along(), node_along(), node_along()};
                std::vector<std::pair<uint32_t, uint32_t>> found;
                for_each_holder(bricks, place, node, n, [&](uint32_t b, uint32_t k) { found.push_back({b, k}); });
                std::sort(found.begin(), found.end());
                const auto expected =
                    holders[{place.x * (n - 1) + node.x, place.y * (n - 1) + node.y, place.z * (n - 1) + node.z}];
                if (found != expected) ++wrong;
                most = std::max<uint64_t>(most, found.size());
                outside += node.x < 0 && !found.empty() ? 1 : 0;
            }
            CAPTURE(stride);
            CHECK(wrong == 0);
            CHECK(most == 8);
            CHECK(outside > 20);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": a grid that is not turned is kept as it is, up to its closed border") {
    const Lists all;
    const Resampled built(all.lists[2], 1);
    const BuiltGrid exact(all.aligned);
    const Box &box = built.bricks().bounds;
    const Vec3 size = box.high - box.low;
    Sequence next{7};
    int met = 0;
    for (int i = 0; i < 8000; ++i) {
        Vec3 x = box.low + vec(next(), next(), next()) * size;
        if (i % 4 == 0) x[i / 4 % 3] = i % 8 ? box.low[i / 4 % 3] : box.high[i / 4 % 3];
        const double sigma = at(extinction(exact.field, x));
        met += sigma > 0 ? 1 : 0;
        // The place in a cell has a rounding of x, here up to 12, in each.
        CHECK(std::fabs(at(extinction(built.field(), x)) - sigma) <= 60 * unit_error);
    }
    CHECK(met > 1000);
    for (int k = 0; k < 3; ++k) {
        Vec3 x = (box.low + box.high) * Real(0.5);
        x[k] = box.high[k] + Real(1e-3);
        CHECK(extinction(built.field(), x) == Real(0));
        x[k] = box.low[k] - Real(1e-3);
        CHECK(extinction(built.field(), x) == Real(0));
    }
}

TEST_CASE(WISP_ARITH_NAME ": optical depths of resampled grids: exact where the density is linear, close elsewhere") {
    std::vector<float> linear(20 * 18 * 16);
    for (size_t i = 0; i < linear.size(); ++i)
        linear[i] = float(1 + 0.125 * double(i % 20) + 0.0625 * double(i / 20 % 18) + 0.25 * double(i / 360));
    GridDescription source = {20, 18, 16, linear.data(), 0.125, {0, 0, 0}, {10, 9, 8}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    Sequence next{4};
    for (bool even : {true, false}) {
        if (!even)
            for (float &d : linear) d = float(next());
        const Resampled built({grid_smoke_of(source)}, 1);
        const BuiltGrid exact(source);
        double sum = 0, difference = 0, squares = 0;
        for (int i = 0; i < 300; ++i) {
            const auto inside = [&] { return vec(19 * next() - 9.5, 17 * next() - 8.5, 15 * next() - 7.5); };
            const Vec3 from = inside(), to = inside();
            const Real way = length(to - from);
            const Ray ray = {from, (to - from) / way};
            const double depth = at(optical_depth(exact.field, ray, way));
            const double error = at(optical_depth(built.field(), ray, way)) - depth;
            if (even) CHECK(std::fabs(error) <= 100 * unit_error * (1 + depth));
            sum += depth;
            difference += error;
            squares += error * error;
        }
        if (even) continue;
        // Samples that have nothing to do with each other: the middles of a path's parts hit and miss.
        CHECK(std::sqrt(squares * 300) < 0.06 * sum);
        CHECK(std::fabs(difference) < 0.01 * sum);
    }
}

TEST_CASE(WISP_ARITH_NAME ": a box is resampled exactly") {
    const Resampled built({box_smoke({4, 6, 3}, 0.75, 20)}, 1);
    const BuiltGrid exact(built.sources[0].grid);
    Sequence next{4};
    for (int i = 0; i < 2000; ++i) {
        const Vec3 x = vec(9 * next() - 4.5, 13 * next() - 6.5, 7 * next() - 3.5);
        CHECK(extinction(built.field(), x) == extinction(exact.field, x));
    }
    CHECK(extinction(built.field(), vec(4, 6, 3)) == Real(0.75));
    CHECK(extinction(built.field(), vec(-4, -6, -3)) == Real(0.75));
    for (int i = 0; i < 300; ++i) {
        const Ray ray = {vec(20 * next() - 10, 20 * next() - 10, 20 * next() - 10),
                         normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375))};
        const Real end = real(i % 3 ? 50 : 5);
        CHECK(std::fabs(at(optical_depth(built.field(), ray, end)) - at(optical_depth(exact.field, ray, end))) <
              400 * unit_error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": resampled particles keep their mass; depths converge with the square of the cell") {
    const std::vector<Particle> particles = unlike_sizes(80, 3, 0.5);
    for (Kernel kernel : {Kernel::spline, Kernel::poly6}) {
        const SmokeDescription source = smoke_of(particles, kernel);
        const BuiltField exact(source);
        double errors[2];
        for (int fine = 0; fine < 2; ++fine) {
            const Resampled built({source}, fine ? 0.25 : 0.5);
            const SparseGrid &bricks = built.bricks();
            const double cell = at(bricks.cell.x);
            // Trilinear between nodes: each node stands for a cell. Nodes on faces are shared out.
            double mass = 0;
            for (uint32_t b = 0; b < bricks.count; ++b)
                for (uint32_t k = 0; k < nodes_of(1); ++k) {
                    const Cell in = cell_of_index(nodes_along(1), k);
                    uint32_t holders = 0;
                    for_each_holder(bricks, bricks.position[b], in, nodes_along(1),
                                    [&](uint32_t, uint32_t) { ++holders; });
                    mass += at(built.field().nodes(b)[k]) / holders;
                }
            mass *= cell * cell * cell;
            CHECK(std::fabs(mass / source.total_area - 1) < (fine ? 1e-4 : 1e-3));

            Sequence next{6};
            double squares = 0, sum = 0, bias = 0;
            for (int i = 0; i < 1500; ++i) {
                const Vec3 aim = vec(6 * next() - 3, 6 * next() - 3, 6 * next() - 3);
                const Vec3 way = normalize(vec(next() - 0.5, next() - 0.5, next() - 0.375));
                const Ray ray = {aim - way * Real(9), way};
                const double depth = at(optical_depth(exact.field, ray, Real(20)));
                const double error = at(optical_depth(built.field(), ray, Real(20))) - depth;
                squares += error * error;
                bias += error;
                sum += depth;
            }
            errors[fine] = std::sqrt(squares * 1500) / sum;
            CHECK(std::fabs(bias) < 0.002 * sum);
        }
        CAPTURE(errors[0]);
        CAPTURE(errors[1]);
        CHECK(errors[0] < 0.01);
        CHECK(errors[1] < 0.3 * errors[0]);
    }
}

TEST_CASE(WISP_ARITH_NAME ": no resampled density lies above its brick's greatest, nor above the majorant of a box") {
    const Lists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 0.6);
        const SparseGrid &bricks = built.bricks();
        const Vec3 size = bricks.bounds.high - bricks.bounds.low;
        for (uint32_t s = 0; s < built.medium.count; ++s) {
            const ResampledField &field = built.field(s);
            for (uint32_t b = 0; b < bricks.count; ++b) {
                const Real *nodes = field.nodes(b);
                CHECK(field.majorants[b] == *std::max_element(nodes, nodes + nodes_of(1)));
            }
            Sequence next{8};
            double tightest = 0;
            for (int round = 0; round < 2000; ++round) {
                const Vec3 low = bricks.bounds.low + vec(next(), next(), next()) * size;
                const Vec3 high = low + vec(next(), next(), next()) * size * Real(0.2);
                const double bound = at(majorant(field, {low, high}));
                for (int k = 0; k < 4; ++k) {
                    const Vec3 x = low + vec(next(), next(), next()) * (high - low);
                    const double sigma = at(extinction(field, x));
                    CHECK(sigma <= bound * (1 + 20 * unit_error) + 20 * unit_error);
                    if (bound > 0) tightest = std::max(tightest, sigma / bound);
                }
            }
            CHECK(tightest > 0.5);
        }
    }
}

TEST_CASE(WISP_ARITH_NAME ": through resampled smoke of absurd density a flight ends") {
    const std::vector<Particle> one = {{{0, 0, 0}, 1, std::is_same_v<Real, Fixed> ? 1e6 : 1e9}};
    const Resampled built({smoke_of(one)}, 0.5);
    const Ray past = {vec(-5, 1.5, 1.5), vec(1, 0, 0)}; // through the empty corners of its brick
    CHECK(!first_collision(built.medium, past, real(10), photon_event(7, 1)).found);
}

TEST_CASE(WISP_ARITH_NAME ": through resampled smoke as many pass as its optical depth says, the rest collides in it") {
    const Lists all;
    for (size_t i = 0; i < resampled_lists; ++i) {
        const Resampled built(all.lists[i], 0.5);
        const Box &bounds = built.medium.bounds;
        const Vec3 middle = (bounds.low + bounds.high) * Real(0.5);
        for (const Vec3 &way : {normalize(vec(1, 0.2, -0.1)), normalize(vec(0.1, -1, 0.4)), vec(0, 0, 1)}) {
            // From inside and from far outside.
            for (double back : {1.0, 40.0}) {
                const Ray ray = {middle + vec(0.3, 0.2, 0.4) - way * real(back), way};
                const Real end = real(back + 60);
                const double depth = at(optical_depth(built.medium, ray, end)), expected = std::exp(-depth);
                const int n = 3000;
                int through = 0, outside = 0;
                std::vector<double> depths;
                for (int k = 0; k < n; ++k) {
                    const MediumCollision hit =
                        first_collision(built.medium, ray, end, photon_event(uint64_t(k) * 7919 + 1, 1));
                    if (!hit.found) {
                        ++through;
                        continue;
                    }
                    const Vec3 x = ray.origin + way * hit.distance;
                    if (!(extinction(built.medium.smokes[hit.smoke].field, x) > Real(0)) || hit.distance > end)
                        ++outside;
                    if (k % 3 == 0) depths.push_back(at(optical_depth(built.medium, ray, hit.distance)));
                }
                CAPTURE(i);
                CAPTURE(depth);
                CHECK(std::fabs(double(through) / n - expected) < 4 * std::sqrt(expected * (1 - expected) / n) + 0.003);
                CHECK(outside == 0);
                if (depths.size() > 100) CHECK(distance_from_exponential(depths, depth) < 1.95);
            }
        }
    }
}

namespace {

// Two smokes of particles with unlike kernels, one of which glows and neither of which scatters evenly, and lights of
// all kinds, one of them among them.
struct Lit {
    Lit() : big(cloud(40, 2, 1.5, 1.2, 3)), small(cloud(60, 1.5, 1, 0.6, 4)) {
        smokes = {smoke_of(big, Kernel::poly6), smoke_of(small)};
        smokes[0].albedo = {0.9, 0.5, 0.2};
        smokes[0].emission = {0.1, 0.2, 0};
        smokes[0].asymmetry = -0.4;
        smokes[1].asymmetry = 0.5;
        lights = {{LightKind::point, {0.5, 0.25, 0.5}, {0, 0, 1}, 2, {4, 5, 6}},
                  {LightKind::spot,
                   {4, 6, 5},
                   {-4 / std::sqrt(77.0), -6 / std::sqrt(77.0), -5 / std::sqrt(77.0)},
                   0.03,
                   {50, 40, 60}},
                  {LightKind::parallel, {}, {-0.6, -0.8, 0}, 2, {3, 2, 1}},
                  {LightKind::constant, {-3, -7, 4}, {0, 0, 1}, 2, {1, 1, 3}}};
        scene.camera = look_at_origin(12, 8, 6);
        scene.background = {0.5, 0.25, 0.125};
        scene.lights = lights.data();
        scene.light_count = 4;
        scene.smokes = smokes.data();
        scene.smoke_count = 2;
    }
    std::vector<Particle> big, small;
    std::vector<SmokeDescription> smokes;
    std::vector<LightSource> lights;
    Scene scene = {};
};

Settings brick_settings(int pixels, double density_step) {
    Settings settings = small_settings(pixels);
    settings.method = Method::map;
    settings.density_step = density_step;
    settings.light_step = density_step;
    return settings;
}

} // namespace

TEST_CASE(WISP_ARITH_NAME ": without photons resampled smoke looks as the exact one does") {
    const Lit lit;
    // Of each light, and of all together; glow and background always.
    for (uint32_t first = 0; first < 5; ++first) {
        Scene scene = lit.scene;
        if (first < 4) scene.lights += first, scene.light_count = 1;
        const Rendered truth = render_in_memory(scene, brick_settings(4, 0));
        REQUIRE(truth.status == Status::done);
        double errors[2];
        for (int fine = 0; fine < 2; ++fine) {
            const Rendered bricks = render_in_memory(scene, brick_settings(4, fine ? 0.3 : 0.6));
            REQUIRE(bricks.status == Status::done);
            errors[fine] = relative_difference(bricks.rgb, truth.rgb);
            CHECK(bricks.statistics.smoke.march_samples > 0);
            CHECK(bricks.statistics.smoke.march_samples <= truth.statistics.smoke.march_samples);
        }
        CAPTURE(first);
        CHECK(errors[0] < 0.03);
        // The square of the cell; but about a light depths have a kink, which is the cell's.
        const bool inside = first == 0 || first == 4;
        CHECK(errors[1] < (inside ? 0.75 : 0.4) * errors[0]);
    }
}

TEST_CASE(WISP_ARITH_NAME ": eight steps at a time through resampled smoke give what one at a time gives") {
    // The same densities and kept depths, marched by method direct, from outside and inside.
    Lit lit;
    for (double z : {12.0, 0.5})
        for (double step : {0.5, 0.07}) {
            lit.scene.camera.origin = {0.3, 0.1, z};
            Settings settings = brick_settings(4, 0.5);
            settings.step = step;
            const Rendered lanes = render_in_memory(lit.scene, settings);
            settings.method = Method::direct;
            const Rendered single = render_in_memory(lit.scene, settings);
            REQUIRE(lanes.status == Status::done);
            REQUIRE(single.status == Status::done);
            CAPTURE(z);
            CAPTURE(step);
            // The inverse square in the middle of a step, 16 and more away, is its mean but for 1 / (12 16^2).
            CHECK(relative_difference(lanes.rgb, single.rgb) < 3e-4);
        }
}

TEST_CASE(WISP_ARITH_NAME ": without lights resampled smoke is what is behind it, dimmed, and its glow") {
    Lit lit;
    lit.scene.light_count = 0;
    for (int glows = 0; glows < 2; ++glows) {
        Settings settings = brick_settings(6, 0.5);
        if (!glows) lit.smokes[0].emission = {0, 0, 0};
        const Rendered bricks = render_in_memory(lit.scene, settings);
        settings.method = Method::direct;
        const Rendered single = render_in_memory(lit.scene, settings);
        REQUIRE(bricks.status == Status::done);
        REQUIRE(single.status == Status::done);
        CHECK(relative_difference(bricks.rgb, single.rgb) < 400 * unit_error);
        lit.smokes[0].emission = {0.1, 0.2, 0};
    }
}

TEST_CASE(WISP_ARITH_NAME ": with bricks a crop is a part of the whole, and the plan's bytes suffice") {
    const Lit lit;
    struct {
        double light_step;
        IrradianceMap irradiance;
        uint64_t photons;
    } const rows[] = {{0, IrradianceMap::none, 0},      {0, IrradianceMap::uniform, 300},
                      {0.5, IrradianceMap::none, 0},    {0.5, IrradianceMap::none, 300},
                      {2, IrradianceMap::uniform, 300}, {1, IrradianceMap::adaptive, 300}};
    for (const auto &row : rows) {
        Settings settings = brick_settings(4, 0.5);
        settings.light_step = row.light_step;
        settings.irradiance = row.irradiance;
        settings.irradiance_step = 2;
        settings.photons = row.photons;
        const Rendered whole = render_in_memory(lit.scene, settings);
        CAPTURE(row.light_step);
        REQUIRE(whole.status == Status::done);
        CHECK(whole.statistics.bytes.arena_peak <= whole.statistics.bytes.arena_size);
        settings.crop = {1, 2, 3, 4};
        const Rendered part = render_in_memory(lit.scene, settings);
        for (size_t y = 0; y < 2; ++y)
            CHECK(std::memcmp(&part.rgb[6 * y], &whole.rgb[3 * (4 * (y + 2) + 1)], 6 * sizeof(float)) == 0);
    }
}

TEST_CASE(WISP_ARITH_NAME ": the plan of a box has its cells, however fine or coarse") {
    Lit lit;
    std::vector<SmokeDescription> box = {box_smoke({4, 6, 3}, 0.75, 20)};
    lit.scene.smokes = box.data();
    lit.scene.smoke_count = 1;
    for (double cell : {0.1, 0.22, 0.3, 0.45, 0.55, 1.0, 3.0}) {
        Settings settings = brick_settings(2, 2 * cell);
        settings.density_step = cell;
        settings.light_step = settings.irradiance_step = 2 * cell;
        settings.irradiance = IrradianceMap::uniform;
        settings.photons = 300;
        CAPTURE(cell);
        const uint64_t bricks = plan_sparse_grid(lit.scene, cell).count;
        CHECK(renderer.plan(lit.scene, settings).bricks == bricks);
        CHECK(renderer.plan(lit.scene, settings).map_sums == plan_fluence(lit.scene, settings, bricks, 2).sums);
        CHECK(render_in_memory(lit.scene, settings).status == Status::done);
    }
}

TEST_CASE(WISP_ARITH_NAME ": with less memory than they need bricks make no picture") {
    const Lit lit;
    Settings settings = brick_settings(2, 1);
    settings.photons = 300;
    const Rendered whole = render_in_memory(lit.scene, settings);
    REQUIRE(whole.status == Status::done);
    std::vector<unsigned char> memory(whole.statistics.bytes.arena_size);
    for (size_t part = 0; part < 30; ++part) {
        Arena arena(memory.data(), whole.statistics.bytes.arena_peak * part / 30);
        std::vector<float> rgb(whole.rgb.size(), -1);
        Statistics statistics;
        CHECK(renderer.render({lit.scene, settings, arena, statistics, {}, rgb.data()}) == Status::out_of_memory);
        CHECK(rgb == std::vector<float>(rgb.size(), -1));
    }
}
