// The smoke simulation: what build/plume writes, and that the air it moves in has neither sources nor leaks.
#include "../../tools/plume/plume_flow.h"
#include "host/base/error.h"
#include "host/base/files.h"
#include "host/formats/particles.h"
#include "support/built.h"
#include "support/temporary_folder.h"
#include "support/worst.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <sys/wait.h>

using namespace wisp;

namespace {

// The exit status of build/plume; what it says on standard error goes to the file `errors`.
int run_plume(const std::string &arguments, const std::string &errors = "/dev/null") {
    const int status = std::system((built("plume") + " " + arguments + " 2> " + errors).c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

// The bytes of the one file that the run writes.
Bytes made(const std::string &arguments) {
    TemporaryFolder folder;
    REQUIRE(run_plume(arguments + " -o " + folder.file("smoke.vtk")) == exit_done);
    REQUIRE(folder.entries() == 1);
    return read_file(folder.file("smoke.vtk"));
}

Particles particles_of(const Bytes &bytes) { return parse_particles("smoke.vtk", bytes.data(), bytes.size()); }

// The `count` floats behind the line `keyword`.
std::vector<float> floats_behind(const Bytes &bytes, const std::string &keyword, size_t count) {
    const std::string text(bytes.begin(), bytes.end());
    const size_t line = text.find(keyword);
    REQUIRE(line != std::string::npos);
    const size_t start = text.find('\n', line) + 1;
    REQUIRE(start + 4 * count <= bytes.size());
    std::vector<float> values(count);
    for (size_t i = 0; i < count; ++i) {
        uint32_t bits = 0;
        for (size_t byte = 0; byte < 4; ++byte) bits = bits << 8 | bytes[start + 4 * i + byte];
        std::memcpy(&values[i], &bits, sizeof bits);
    }
    return values;
}

double distance(const std::array<double, 3> &a, const std::array<double, 3> &b) {
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return std::sqrt(x * x + y * y + z * z);
}

double mean_height(const Particles &particles) {
    double sum = 0;
    for (const auto &p : particles.position) sum += p[0];
    return sum / static_cast<double>(particles.position.size());
}

double mean_distance_to_nearest(const Particles &particles) {
    double sum = 0;
    for (size_t i = 0; i < particles.position.size(); ++i) {
        double nearest = 1e9;
        for (size_t j = 0; j < particles.position.size(); ++j)
            if (i != j) nearest = std::min(nearest, distance(particles.position[i], particles.position[j]));
        sum += nearest;
    }
    return sum / static_cast<double>(particles.position.size());
}

} // namespace

TEST_CASE("plume: frame F at rate N holds N (F + 1) + 1 particles, each with velocity and density") {
    for (const auto &[rate, frame] : {std::pair{1, 0}, {7, 3}, {100, 2}}) {
        const size_t count = static_cast<size_t>(rate * (frame + 1) + 1);
        const Bytes bytes = made("--rate " + std::to_string(rate) + " --frame " + std::to_string(frame));
        const std::string n = std::to_string(count);
        const std::string text = "# vtk DataFile Version 4.1\nwisp plume\nBINARY\nDATASET POLYDATA\nPOINTS " + n +
                                 " float\n\nVERTICES 1 " + std::to_string(count + 1) + "\n\nPOINT_DATA " + n +
                                 "\nVECTORS velocity float\n\nSCALARS density float 1\nLOOKUP_TABLE default\n\n";
        CHECK(bytes.size() == text.size() + 4 * (3 * count + count + 1 + 3 * count + count));
        const Particles particles = particles_of(bytes);
        CHECK(particles.position.size() == count);
        CHECK(particles.density.size() == count);
    }
}

TEST_CASE("plume: makes its fixture again, byte for byte") {
    CHECK(made("--sph --rate 28 --frame 215") == read_file("fixtures/plume.vtk"));
}

TEST_CASE("wake: makes its fixtures again, byte for byte") {
    TemporaryFolder folder;
    REQUIRE(std::system((built("wake") + " fixtures/wake.aff -o " + folder.file("%d.vtk")).c_str()) == 0);
    CHECK(folder.entries() == 5);
    for (int frame = 0; frame < 5; ++frame)
        CHECK(read_file(folder.file(std::to_string(frame) + ".vtk")) ==
              read_file("fixtures/wake_000" + std::to_string(frame) + ".vtk"));
}

TEST_CASE("plume: particles stay in the box and rise, with finite velocities") {
    const Bytes early = made("--sph --rate 28 --frame 5"), late = read_file("fixtures/plume.vtk");
    const Particles particles = particles_of(late);
    for (const auto &p : particles.position) {
        CHECK((p[0] >= 0 && p[0] <= 65));
        CHECK((p[1] >= 0 && p[1] <= 19));
        CHECK((p[2] >= 0 && p[2] <= 26));
    }
    CHECK(mean_height(particles) > mean_height(particles_of(early)) + 10);
    double fastest = 0;
    for (const float v : floats_behind(late, "VECTORS velocity float", 3 * particles.position.size())) {
        REQUIRE(std::isfinite(v));
        fastest = std::max(fastest, std::fabs(static_cast<double>(v)));
    }
    CHECK(fastest > 0.1);
    CHECK(fastest < 2); // cells a frame
}

TEST_CASE("plume: density is the sum of spline kernels") {
    const Particles particles = particles_of(made("--rate 30 --frame 8"));
    const double h = 0.2 * std::cbrt(400.0 / 30), mass = 1.0 / 30;
    for (size_t i = 0; i < particles.position.size(); i += 10) {
        double expected = 0;
        for (const auto &p : particles.position) { // S3, spline
            const double q = distance(p, particles.position[i]) / h;
            if (q < 2) expected += mass * 15 / (pi<double> * std::pow(4 * h, 3)) * std::pow(2 - q, 3);
        }
        CHECK(particles.density[i] == doctest::Approx(expected).epsilon(1e-5)); // positions are floats
    }
}

TEST_CASE("plume: the same options give the same bytes, others give others") {
    const Bytes plain = made("--rate 9 --frame 4");
    CHECK(made("--rate 9 --frame 4") == plain);
    CHECK(made("--rate=9 --frames=4 --seed=1") == plain);
    CHECK(made("--rate 9 --frame 4 --seed 2") != plain);
    CHECK(made("--rate 9 --frame 4 --sph") != plain);
    CHECK(made("--frame 0") == made("--rate 400 --frame 0"));
}

TEST_CASE("plume: a run over several frames writes what runs for each frame write") {
    TemporaryFolder folder;
    REQUIRE(run_plume("--rate 5 --frames 1:6:2 --sph -o " + folder.file("smoke%04d.vtk")) == exit_done);
    CHECK(folder.entries() == 3);
    for (const char *frame : {"1", "3", "5"})
        CHECK(read_file(folder.file(std::string("smoke000") + frame + ".vtk")) ==
              made(std::string("--rate 5 --sph --frame ") + frame));
}

TEST_CASE("plume: interaction evens out the spacing and leaves the plume where it is") {
    const Particles alone = particles_of(made("--rate 20 --frame 30"));
    const Particles together = particles_of(made("--rate 20 --frame 30 --sph"));
    CHECK(mean_distance_to_nearest(together) > 1.05 * mean_distance_to_nearest(alone));
    CHECK(mean_height(together) == doctest::Approx(mean_height(alone)).epsilon(0.02));
}

TEST_CASE("plume: wrong usage is said in one line, with status 2, and writes nothing") {
    TemporaryFolder folder, errors;
    const std::string out = " -o " + folder.file("smoke.vtk");
    const std::vector<std::string> wrong_usages = {"",
                                                   "--frame 0",
                                                   "--frame 0 -o",
                                                   out,
                                                   "--frame" + out,
                                                   "--frame x" + out,
                                                   "--frame -1" + out,
                                                   "--frame 10000" + out,
                                                   "--frame 1:2" + out,
                                                   "--frames 2:1" + out,
                                                   "--frames 0:4:0" + out,
                                                   "--frames 0:1:2:3" + out,
                                                   "--frames 0:1" + out, // one name for two frames
                                                   "--frame 0 --rate 0" + out,
                                                   "--frame 0 --rate 1.5" + out,
                                                   "--frame 0 --seed -1" + out,
                                                   "--frame 0 --sph=1" + out,
                                                   "--frame 0 --wind 3" + out,
                                                   "--frame 0 stray" + out};
    for (const std::string &wrong : wrong_usages) {
        CAPTURE(wrong);
        CHECK(run_plume(wrong, errors.file("errors")) == exit_usage);
        const Bytes said = read_file(errors.file("errors"));
        CHECK(std::count(said.begin(), said.end(), '\n') == 1);
        CHECK(folder.entries() == 0);
    }
}

TEST_CASE("plume: a file that cannot be written is said with status 5") {
    TemporaryFolder folder;
    CHECK(run_plume("--rate 1 --frame 0 -o " + folder.file("none/smoke.vtk")) == exit_output);
    CHECK(folder.entries() == 0);
}

TEST_CASE("plume: air has no sources, in cells and in between, and does not cross the walls") {
    using namespace plume;
    Flow flow(1);
    for (int frame = 0; frame < 20; ++frame) flow.step();
    const Velocity &air = flow.velocity();

    double largest = 0;
    for_each_point(cells_x, cells_y, cells_z,
                   [&](int i, int j, int k) { largest = worst_of(largest, std::fabs(air.divergence(i, j, k))); });
    CHECK(largest < 1e-14);

    // Any place, by differences: of the order of the step where a spline's piece ends.
    constexpr double step = 1e-5;
    double shear = 0, divergence = 0, leak = 0;
    for (uint32_t i = 0; i < 1000; ++i) {
        const auto coordinate = [&](uint32_t axis, double middle, double range) {
            return middle + range * (unit_half_open<double>(draw(photon_event(9, i), axis)) - 0.5);
        };
        const Vec3 p(coordinate(0, 8, 14), coordinate(1, 9.5, 18), coordinate(2, 13, 25));
        const Vec3 x(step, 0, 0), y(0, step, 0), z(0, 0, step);
        const Vec3 dx = (air.at(p + x) - air.at(p - x)) / (2 * step), dy = (air.at(p + y) - air.at(p - y)) / (2 * step),
                   dz = (air.at(p + z) - air.at(p - z)) / (2 * step);
        divergence = std::max(divergence, std::fabs(dx.x + dy.y + dz.z));
        shear = std::max(shear, std::fabs(dx.x));
        const double through[3] = {air.at({0, p.y, p.z}).x, air.at({p.x, 19, p.z}).y, air.at({p.x, p.y, 0}).z};
        for (const double v : through) leak = std::max(leak, std::fabs(v));
    }
    CHECK(leak < 1e-16);
    CHECK(shear > 0.02);
    CHECK(divergence < 1e-5);
}
