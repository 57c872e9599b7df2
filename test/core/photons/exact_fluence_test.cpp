// Photons through exact smoke, and their fluence at the nodes of bricks (S2, S4-3).
#include "core/photons/exact_fluence.h"
#include "core/smoke/resampling.h"
#include "support/built_sparse_grid.h"
#include "support/compared_pictures.h"
#include <string>

using namespace wisp;
using namespace wisp::WISP_ARITH;

namespace {

Settings node_settings(int pixels, double cell, uint64_t photons) {
    Settings settings = small_settings(pixels);
    settings.method = Method::map;
    settings.deposit = Deposit::nodes;
    settings.irradiance = IrradianceMap::uniform;
    settings.irradiance_step = cell;
    settings.photons = photons;
    return settings;
}

// A box of 3 x 2 x 2.5 in no plane of a lattice.
SmokeDescription turned_box(double sigma, const Double3 &center = {0, 0, 0}, const Double3 &half = {1.5, 1, 1.25}) {
    SmokeDescription box = box_smoke(half, sigma, 12);
    box.grid.center = center;
    box.grid.axis[0] = {0.8, 0.48, 0.36};
    box.grid.axis[1] = {-0.6, 0.64, 0.48};
    box.grid.axis[2] = {0, -0.6, 0.8};
    return box;
}

// Particles, and smokes of which none can be resampled together with the others.
struct Smokes {
    std::vector<Particle> particles = cloud(200, 1.2, 0.5, 0.03), dense = cloud(200, 1.2, 0.5, 0.2);
    std::vector<SmokeDescription> round, turned, apart, overlapping, beside_black;

    Smokes() {
        round = {smoke_of(dense)};
        turned = {turned_box(1.2)};
        apart = {box_smoke({0.5, 1, 1}, 1.5, 12), box_smoke({0.5, 1, 1}, 3, 12)};
        apart[0].grid.center = {-0.75, 0, 0};
        apart[1].grid.center = {0.75, 0.25, 0};
        overlapping = {turned_box(0.8), smoke_of(particles)};
        beside_black = {box_smoke({1, 1, 1}, 1, 12), turned_box(1)};
        beside_black[1].albedo = {0, 0, 0};
    }
};

Scene scene_of_all(const std::vector<SmokeDescription> &smokes, const std::vector<LightSource> &lights) {
    Scene scene = scene_of(smokes[0], lights);
    scene.smokes = smokes.data();
    scene.smoke_count = static_cast<uint32_t>(smokes.size());
    scene.camera = look_at_origin(12, 3.5, 4);
    return scene;
}

const LightSource slanted = {LightKind::parallel, {}, {0, -0.6, -0.8}, 2, {3, 3, 3}},
                  inside = {LightKind::point, {0.4, -0.3, 0.1}, {0, 0, 1}, 2, {9, 9, 9}};

} // namespace

TEST_CASE(WISP_ARITH_NAME ": photons at nodes of exact smoke are as bright as the reference" *
          doctest::test_suite("long")) {
    const Smokes of;
    const auto grey = [](double a) { return Double3{a, a, a}; };
    struct {
        const char *name;
        std::vector<SmokeDescription> smokes;
        LightSource light;
        double g[2];
        Double3 albedo[2];
        bool glows;
    } const rows[] = {{"turned", of.turned, slanted, {0, 0}, {grey(0.9)}, false},
                      {"forward", of.turned, slanted, {0.5, 0}, {grey(0.9)}, false},
                      {"backward", of.turned, slanted, {-0.5, 0}, {grey(0.9)}, false},
                      {"coloured", of.turned, slanted, {0, 0}, {{1, 0.8, 0.5}}, false},
                      {"lamp inside", of.turned, inside, {0, 0}, {grey(0.9)}, false},
                      {"glowing", of.turned, slanted, {0, 0}, {grey(0.9)}, true},
                      {"unlike", of.apart, slanted, {0.5, -0.4}, {grey(0.9), {0.6, 0.9, 0.8}}, false},
                      {"overlapping", of.overlapping, slanted, {0.5, -0.4}, {grey(0.9), {0.6, 0.9, 0.8}}, false},
                      {"black", of.beside_black, slanted, {0, 0.57}, {grey(1), grey(0)}, false}};
    for (const auto &row : rows) {
        CAPTURE(std::string(row.name));
        std::vector<SmokeDescription> smokes = row.smokes;
        for (size_t i = 0; i < smokes.size(); ++i) {
            smokes[i].asymmetry = row.g[i];
            smokes[i].albedo = row.albedo[i];
            if (row.glows) smokes[i].emission = {0.5, 0.25, 0};
        }
        const std::vector<LightSource> lights = {row.light};
        Scene scene = scene_of_all(smokes, lights);
        scene.light_count = row.glows ? 0 : 1;
        REQUIRE(!can_resample(scene));
        double noise;
        const std::vector<float> truth = reference_of(scene, 4, 500, noise);
        Settings settings = node_settings(4, 1.1, 40000);
        const Plan plan = renderer.plan(scene, settings);
        const bool isotropic = row.g[0] == 0 && row.g[1] == 0;
        CHECK(plan.photon_directions == (isotropic ? Plan::Directions::none : Plan::Directions::to_eye));
        CHECK(!plan[Stage::gather].needed);
        const Rendered picture = render_in_memory(scene, settings);
        REQUIRE(picture.status == Status::done);
        const auto &counts = picture.statistics.photons;
        CHECK(adds_up(counts));
        CHECK(counts.stored > 5000);
        CHECK(counts.lost == 0);
        const double error = std::sqrt(noise * noise / 16 + 2 / static_cast<double>(counts.stored));
        CAPTURE(sum_of(picture.rgb) / sum_of(truth));
        CAPTURE(error);
        CHECK(error < 0.03);
        CHECK(std::fabs(sum_of(picture.rgb) / sum_of(truth) - 1) < 3 * error + 0.01);
        CHECK(relative_difference(picture.rgb, truth) < 2 * noise + 0.05);
        settings.photons = 0; // what is scattered twice and more is a good part of it
        CHECK(sum_of(render_in_memory(scene, settings).rgb) < 0.9 * sum_of(truth));
    }
}

TEST_CASE(WISP_ARITH_NAME ": the light at nodes of exact smoke gives back every collision, up to its hard faces") {
    const Smokes of;
    for (const std::vector<SmokeDescription> &smokes : {of.round, of.turned, of.apart, of.overlapping}) {
        const std::vector<LightSource> lights = {slanted};
        const Scene scene = scene_of_all(smokes, lights);
        const Settings settings = node_settings(4, 1, 6000);
        const PhotonNeeds needs = photon_needs(scene, settings);
        const uint64_t count = plan_sparse_grid(scene, 1).count, sum_count = sums_of_fluence(needs, count, 1);
        std::vector<unsigned char> memory(medium_bytes(scene, 0) + plan_sparse_grid(scene, 1).bytes +
                                          exact_fluence_bytes(scene, needs, count, 1) + tent_bytes(count, 1));
        Arena arena(memory.data(), memory.size());
        const Medium medium = make_medium(scene, 0, arena);
        const SparseGrid bricks = make_sparse_grid(scene, 1, arena);
        REQUIRE(medium.ready);
        REQUIRE(bricks.ready);
        const Light light = make_light(lights[0]);
        PhotonSums sums = {arena.make<int64_t>(sum_count), sum_count, 0};
        Statistics statistics = {};
        FluenceSums fluence;
        REQUIRE(trace_exact_fluence({medium, nullptr, settings, needs, all_batches(settings), {}, arena, statistics},
                                    bricks, 1, &light, 1, sums, fluence) == Status::done);
        double deposited = 0;
        for (uint64_t i = 0; i < uint64_t{bricks.count} * nodes_of(1); ++i)
            deposited += static_cast<double>(fluence.power[i]) * 0x1p-24;
        const double stored = static_cast<double>(statistics.photons.stored);
        CHECK(stored > 1500);
        CHECK(deposited == doctest::Approx(stored).epsilon(1e-5));
        // The integral of sigma_t times the interpolated light, by points drawn in the smoke's bounds.
        REQUIRE(find_tents(fluence, arena));
        const Vec3 extent = bricks.bounds.high - bricks.bounds.low;
        Sequence next{9};
        double collisions = 0, squares = 0;
        const int points = 60000;
        for (int i = 0; i < points; ++i) {
            const Vec3 x = bricks.bounds.low + vec(next() * at(extent.x), next() * at(extent.y), next() * at(extent.z));
            const double sigma = at(extinction(medium, x));
            const uint32_t brick = brick_at(bricks, cell_at(bricks.lattice, x));
            if (!(sigma > 0) || brick == no_brick) continue;
            const CellPosition cell = find_cell(position_in(bricks, brick, x), 1);
            const double sent = 4 * pi_ * sigma * at(between_nodes(cell, 1, [&](uint32_t k) {
                                    FluenceAndFlux there;
                                    light_at_node(fluence, brick, cell_of_index(nodes_along(1), k), there);
                                    return there.radiance.x;
                                }));
            collisions += sent;
            squares += sent * sent;
        }
        const double volume =
            at(extent.x) * at(extent.y) * at(extent.z) / std::ldexp(at(fluence.unit.unit), fluence.unit.exponent);
        const double error = std::sqrt(squares - collisions * collisions / points) / points * volume;
        // The integral around single nodes, over their bricks.
        const double unit_of_sigma = std::ldexp(216.0, fluence.sigma_shift);
        double difference = 0, whole = 0;
        for (int i = 0; i < 200; ++i) {
            const uint32_t brick = static_cast<uint32_t>(next() * bricks.count),
                           node = static_cast<uint32_t>(next() * nodes_of(1));
            const Cell of_node = cell_of_index(nodes_along(1), node);
            double sum = 0;
            constexpr int along = 10, drawn = along * along * along; // in equal parts of two cells along each axis
            for (int k = 0; k < drawn; ++k) {
                const int part[3] = {k % along, k / along % along, k / along / along};
                double tent = 1;
                Vec3 p;
                for (int axis = 0; axis < 3; ++axis) {
                    const int32_t middle = axis == 0 ? of_node.x : axis == 1 ? of_node.y : of_node.z;
                    const double away = 2 * (part[axis] + next()) / along - 1;
                    tent *= middle + away < 0 || middle + away > brick_cells ? 0 : 1 - std::fabs(away);
                    p[axis] = Real(middle + away);
                }
                const Vec3 x = low_of(bricks, brick) + p * bricks.cell;
                sum += tent > 0 ? tent * at(extinction(medium, x)) : 0;
            }
            const double expected = 8 * sum / drawn;
            whole += expected;
            difference += std::fabs(at(fluence.tents[size_t{brick} * nodes_of(1) + node]) / unit_of_sigma - expected);
        }
        CAPTURE(difference / whole);
        CHECK(whole > 5);
        CHECK(difference < 0.03 * whole);
        CAPTURE(collisions / points * volume / deposited);
        CHECK(error < 0.02 * deposited);
        CHECK(std::fabs(collisions / points * volume - deposited) < 4 * error);
    }
}

TEST_CASE(WISP_ARITH_NAME ": batches traced apart through exact smoke give the sums and the picture of one run") {
    const Smokes of;
    std::vector<SmokeDescription> smokes = of.overlapping;
    smokes[0].albedo = {0.9, 0.5, 0.2};
    smokes[1].asymmetry = 0.5;
    smokes[1].emission = {0.1, 0.2, 0};
    const std::vector<LightSource> lights = {inside, slanted};
    const Scene scene = scene_of_all(smokes, lights);
    Settings settings = node_settings(4, 1.1, 2 * batch_photons + 100);
    const Plan planned = renderer.plan(scene, settings);
    std::vector<unsigned char> memory(planned.arena_bytes);
    std::vector<int64_t> whole(planned.map_sums), parts(planned.map_sums);
    const auto trace = [&](std::vector<int64_t> &values, uint64_t count, const Batches &batches) {
        Arena arena(memory.data(), memory.size());
        PhotonSums sums = {values.data(), values.size(), count};
        Statistics statistics = {};
        REQUIRE(trace_batches(scene, settings, batches, arena, sums, statistics) == Status::done);
        CHECK(sums.count == values.size());
    };
    trace(whole, 0, {0, 3});
    trace(parts, 0, {2, 3});
    trace(parts, parts.size(), {0, 1});
    CHECK(parts != whole);
    trace(parts, parts.size(), {1, 2});
    CHECK(parts == whole);
    const Rendered alone = render_in_memory(scene, settings);
    REQUIRE(alone.status == Status::done);
    std::vector<float> rgb(alone.rgb.size());
    Arena arena(memory.data(), memory.size());
    PhotonSums sums = {parts.data(), parts.size(), parts.size()};
    Statistics statistics = {};
    REQUIRE(renderer.render({scene, settings, arena, statistics, {}, rgb.data(), &sums}) == Status::done);
    CHECK(rgb == alone.rgb);
    settings.seed = 2;
    CHECK(render_in_memory(scene, settings).rgb != alone.rgb);
}

TEST_CASE(WISP_ARITH_NAME
          ": what is kept towards the eye is the phase of what scatters in exact smoke, not of what absorbs") {
    // Of two boxes in the same place one scatters, into all directions alike, so 4 pi p is 1. It is scaled by 1 / 8: of
    // the other box, it may be 6.
    std::vector<SmokeDescription> smokes = {turned_box(1), turned_box(1)};
    smokes[1].albedo = {0, 0, 0};
    smokes[1].asymmetry = 0.5;
    const std::vector<LightSource> lights = {slanted};
    for (const bool swapped : {false, true}) {
        if (swapped) std::swap(smokes[0], smokes[1]);
        const Scene scene = scene_of_all(smokes, lights);
        const Settings settings = node_settings(4, 1.1, 4000);
        const Plan plan = renderer.plan(scene, settings);
        REQUIRE(plan.photon_directions == Plan::Directions::to_eye);
        std::vector<unsigned char> memory(plan.arena_bytes);
        std::vector<int64_t> values(plan.map_sums);
        Arena arena(memory.data(), memory.size());
        PhotonSums sums = {values.data(), values.size(), 0};
        Statistics statistics = {};
        REQUIRE(trace_batches(scene, settings, all_batches(settings), arena, sums, statistics) == Status::done);
        double total = 0;
        for (const int64_t value : values) total += static_cast<double>(value) * 0x1p-24;
        CHECK(statistics.photons.stored > 500);
        CHECK(total * 8 == doctest::Approx(static_cast<double>(statistics.photons.stored)).epsilon(1e-4));
    }
}

TEST_CASE(WISP_ARITH_NAME ": exact smoke has photons at nodes only where a map keeps them, else on its elements") {
    const Smokes of;
    const std::vector<LightSource> lights = {slanted};
    const Scene scene = scene_of_all(of.overlapping, lights);
    Settings settings = node_settings(4, 1.1, 1000);
    const uint64_t bricks = plan_sparse_grid(scene, 1.1).count;
    CHECK(renderer.plan(scene, settings).map_sums == sums_of_fluence(photon_needs(scene, settings), bricks, 1));
    CHECK(!renderer.plan(scene, settings)[Stage::light_depths].needed);
    settings.irradiance = IrradianceMap::none; // nodes are of the map
    const std::vector<float> without = render_in_memory(scene, settings).rgb;
    settings.deposit = Deposit::exact;
    CHECK(render_in_memory(scene, settings).rgb == without);
    settings.photons = 0;
    CHECK(sum_of(render_in_memory(scene, settings).rgb) < 0.95 * sum_of(without));
}
