// What does not fit in memory is refused before any work, with what takes most of it and what would fit. A limit on the
// process's addresses (ulimit -v) stands for a small machine.
#include "host/base/error.h"
#include "host/base/text.h"
#include "host/commands/memory_check.h"
#include "host/images/picture.h"
#include "host/results/picture_bytes.h"
#include "support/command_line.h"
#include <numeric>

using namespace wisp;

namespace {

// The sum of a plan's rows and its picture.
uint64_t needed(const Request &request, const PreparedScene &prepared) {
    const Settings settings = settings_of(request.options, prepared);
    const Plan plan = checked_plan(request, prepared.scene, settings);
    return needed_bytes(settings, plan);
}

struct Planned {
    explicit Planned(const CommandLine &line) : request(read_request(line)) {
        prepare_scene(request.name, request.file, request.options, request.frames.first, prepared);
    }
    // The error where so many bytes are available; "" where they suffice.
    std::string refusal(uint64_t available) const {
        const Settings settings = settings_of(request.options, prepared);
        try {
            check_memory(request, prepared, settings, checked_plan(request, prepared.scene, settings), available);
        } catch (const Error &error) {
            CHECK(error.status == exit_memory);
            return error.text;
        }
        return "";
    }
    Request request;
    PreparedScene prepared;
};

std::string between(const std::string &text, const std::string &before, const std::string &after) {
    const size_t start = text.find(before);
    if (start == std::string::npos) return "";
    const size_t first = start + before.size();
    return text.substr(first, text.find(after, first) - first);
}

} // namespace

TEST_CASE("memory: no advice with which a map would be refused") {
    CommandLineTest test;
    test.write("s.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 4 {\n}"));
    const std::string map = test.file("m.map");
    REQUIRE(test.wisp("render " + test.s() + " -q --photons 10k --density-step 0.2 --map-out " + map + " -o " +
                      test.file("p.pfm"))
                .status == 0);
    const auto refused = [&](const std::string &more) {
        const Ran ran = test.wisp("render " + test.s() + " -q --photons 10k --density-step 0.2 --memory 40M -o " +
                                  test.file("p.pfm") + more);
        CHECK(ran.status == exit_memory);
        return ran.err;
    };
    CHECK(refused("").find("; --density-step ") != std::string::npos);
    CHECK(refused(" --map-in " + map).find("--density-step") == std::string::npos);
}

TEST_CASE("memory: a refusal names the largest stage, and an option that makes the plan fit") {
    CommandLineTest test;
    test.write("box.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 0.5 {\n}"));
    test.write("triangle.aff", "v from 0 0 6 at 0 0 0 up 0 1 0 angle 35 hither 0.1 resolution 640 480\nl 1 1 4\n"
                               "p 3\n-1 -1 0\n1 -1 0\n0 1 0\n");
    const struct {
        const char *scene;
        std::vector<std::pair<std::string, std::string>> options;
    } cases[] = {{"s.aff", {}},
                 {"s.aff", {{"photons", "1000000"}, {"smoke", "direct"}}},
                 {"s.aff", {{"photons", "1000000"}, {"smoke", "volume"}, {"arith", "fixed"}}},
                 {"s.aff", {{"size", "4000x3000"}}},
                 {"box.aff", {{"arith", "f64"}}},
                 {"triangle.aff", {}},
                 {"triangle.aff", {{"size", "4000x3000"}, {"layers", "1"}}},
                 {"triangle.aff", {{"size", "4000x3000"}, {"reference", "1"}, {"layers", "1"}}},
                 {"triangle.aff", {{"size", "4000x3000"}, {"reference", "1"}}}};
    int advised = 0;
    for (const auto &one : cases) {
        CAPTURE(one.scene);
        const Planned planned({{test.file(one.scene)}, one.options});
        const Settings settings = settings_of(planned.request.options, planned.prepared);
        const Plan plan = checked_plan(planned.request, planned.prepared.scene, settings);
        const uint64_t picture = picture_bytes(settings, plan), all = plan.arena_bytes + picture;
        uint64_t largest = picture;
        std::string name = "picture";
        for (const PlanRow &row : plan.rows) {
            if (row.bytes >= largest) name = row.name;
            largest = std::max(largest, row.bytes);
        }
        CHECK(planned.refusal(all) == "");
        for (uint64_t available : {all - 1, all / 2, all / 10, uint64_t{1}}) {
            const std::string text = planned.refusal(available);
            CAPTURE(text);
            const std::string start = "the plan needs " + std::to_string(all) + " bytes, " + std::to_string(largest) +
                                      " of them for '" + name + "', expected at most the " + std::to_string(available) +
                                      " that are available here";
            CHECK(text.substr(0, start.size()) == start);
            if (text.size() == start.size()) continue;
            // What it advises has been planned: it fits, and needs as much as it says.
            ++advised;
            auto options = one.options;
            const std::string option = between(text, "; --", " ");
            options.emplace_back(option, between(text, "--" + option + " ", " "));
            const Planned changed({{test.file(one.scene)}, options});
            const uint64_t less = needed(changed.request, changed.prepared);
            CHECK(less <= available);
            CHECK(text == start + "; --" + option + " " + options.back().second + " needs " + std::to_string(less));
        }
        CHECK(planned.refusal(1).find(" needs ", 15) == std::string::npos); // nothing fits in one byte
    }
    CHECK(advised > 10);
}

TEST_CASE("memory: --memory counts where it is less than what is available") {
    CommandLineTest test;
    const Planned planned({{test.s()}, {{"memory", "4k"}}});
    CHECK(planned.refusal(1 << 30).find("expected at most the 4096 of --memory") != std::string::npos);
    CHECK(planned.refusal(4095).find("expected at most the 4095 that are available here") != std::string::npos);
}

TEST_CASE("memory: shadows are traced where --memory has no room for proofs, and the pictures are the same") {
    CommandLineTest test;
    const std::string scene = "fixtures/surfaces.aff --size 20x15 --spp 1 --frames 0:2 ";
    const auto digests = [&](const std::string &more) {
        return test.wisp("render " + scene + "-q --digest -o " + test.file("%04d.pfm") + more).out;
    };
    const std::string plenty = digests("");
    CHECK(lines(plenty) == 3);
    CHECK(digests(" --memory 500k") == plenty);
    const std::string rows = test.wisp("plan " + scene + "--memory 500k").out;
    CHECK(rows.find("a ray for each, 5 lights: what proofs keep does not fit in --memory\n") != std::string::npos);
    CHECK(test.wisp("plan " + scene + "--memory 2M").out.find("--memory") == std::string::npos);
    const Ran asked = test.wisp("plan " + scene + "--shadows exact --memory 500k");
    CHECK(asked.status == exit_memory);
    CHECK(asked.err.find("; --shadows trace needs ") != std::string::npos);
}

TEST_CASE("memory: what fits in less fits in more, beside a picture and surfaces, too" * doctest::test_suite("long")) {
    CommandLineTest test;
    test.write("both.aff", "v from 0 0 9 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 64 64\nl 0 9 9\n"
                           "s 0 0 -3 1\ns 2 0 -3 1\nsmoke puff.vtk { radius 0.3 mass 1 extinction 0.1 }\n");
    test.write("puff.vtk", CommandLineTest::puff(300));
    for (const std::string scene :
         {"fixtures/small.aff --size 600x400", "fixtures/grid.aff --size 300x200", "both.aff"}) {
        CAPTURE(scene);
        const std::string words = "plan " + (scene == "both.aff" ? test.file(scene) : scene) + " -q --memory ";
        bool fitted = false;
        for (int kilobytes = 64; kilobytes < 1 << 18; kilobytes += kilobytes / 8) {
            const bool fits = test.wisp(words + std::to_string(kilobytes) + "k").status == 0;
            CHECK_MESSAGE((fits || !fitted), kilobytes, "k");
            fitted |= fits;
        }
        CHECK(fitted);
    }
}

TEST_CASE("memory: what the defaults need is enough for them, in each arithmetic, and with a byte less rows say so") {
    CommandLineTest test;
    test.write("box.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 0.5 {\n}"));
    for (const std::string &scene :
         {test.file("box.aff"), std::string("fixtures/small.aff"), std::string("fixtures/grid.aff")})
        for (const std::string arithmetic : {"f32", "f64", "fixed"}) {
            CAPTURE(scene);
            CAPTURE(arithmetic);
            const std::string words = "plan " + scene + " --arith " + arithmetic + " -q", rows = test.wisp(words).out;
            const uint64_t bytes = std::stoull(between(rows, "\narena          yes ", " bytes")) +
                                   std::stoull(between(rows, "\npicture        yes ", " bytes"));
            CHECK(test.wisp(words + " --memory " + std::to_string(bytes)).out == rows);
            const Ran less = test.wisp(words + " --memory " + std::to_string(bytes - 1));
            CHECK(less.status == 0); // small.aff and grid.aff have coarser cells
            if (scene != test.file("box.aff")) continue;
            CHECK(less.out.find(": there is no room for bricks within --memory\n") != std::string::npos);
            CHECK(less.out.find("paths from rays instead: there is no room for bricks or photons within --memory\n") !=
                  std::string::npos);
        }
}

TEST_CASE("memory: particles are summed one by one where --memory has no room for bricks of them" *
          doctest::test_suite("long")) {
    CommandLineTest test;
    const std::string scene = "fixtures/small.aff -q ";
    CHECK(test.wisp("plan " + scene).out.find("\nbricks         yes ") != std::string::npos);
    const std::string rows = test.wisp("plan " + scene + "--memory 1M").out;
    CHECK(rows.find("\nbricks         no ") != std::string::npos);
    CHECK(rows.find("paths from rays instead") != std::string::npos);
    const auto mean = [&](const std::string &options) {
        REQUIRE(test.wisp("render " + scene + options + " -o " + test.file("p.pfm")).status == 0);
        const Picture picture = read_pfm(test.file("p.pfm"));
        return std::accumulate(picture.rgb.begin(), picture.rgb.end(), 0.0);
    };
    // Of 120,000 paths the mean's standard deviation is 1 %.
    CHECK(mean("--memory 1M --photons 120000") == doctest::Approx(mean("")).epsilon(0.04));
    CHECK(test.wisp("plan " + scene + "--memory 600k").status == exit_memory);
    const Ran less = test.wisp("plan " + scene + "--irradiance uniform --memory 1M");
    CHECK(less.status == exit_memory);
    CHECK(less.err.find("; --irradiance none needs ") != std::string::npos);
}

TEST_CASE("memory: a plan beyond the memory of the machine is refused before any work") {
    if (has_address_sanitizer) return skip_case("no limit on addresses with AddressSanitizer");
    CommandLineTest test;
    const std::string scene = test.s() + " --smoke direct --photons 4000000";
    for (const std::string &command : {"plan " + scene, "render " + scene + " --digest", "inspect " + scene + " 3 4"}) {
        CAPTURE(command);
        const Ran ran = test.wisp_within(400000, command);
        test.refuses(ran, 4);
        CHECK(ran.err.find("for 'photons', expected at most the ") != std::string::npos);
        CHECK(ran.err.find(" that are available here; --photons ") != std::string::npos);
    }
}

TEST_CASE("memory: a file that is larger than the memory of the machine is refused by its name") {
    if (has_address_sanitizer) return skip_case("no limit on addresses with AddressSanitizer");
    CommandLineTest test;
    for (const char *name : {"huge.vtk", "huge.vol", "huge.aff"}) {
        test.write(name, name == std::string("huge.vol") ? "VOL\3" : "# vtk DataFile Version 3.0\n");
        std::filesystem::resize_file(test.file(name), uint64_t{1} << 32);
    }
    test.write("points.aff", CommandLineTest::scene("huge.vtk", ""));
    test.write("grid.aff", CommandLineTest::lit("huge.vol {\n}"));
    for (const auto &[scene, file] :
         {std::pair("points.aff", "huge.vtk"), std::pair("grid.aff", "huge.vol"), std::pair("huge.aff", "huge.aff")}) {
        const Ran ran = test.wisp_within(400000, "plan " + test.file(scene));
        test.refuses(ran, 4);
        CHECK(ran.err.rfind(test.file(file) + ": error: the file needs 4294967296 bytes, expected at most the ", 0) ==
              0);
    }
}
