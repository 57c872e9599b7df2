// Saved particle maps as a user meets them: other views from one map, tracing in parts, and every refusal.
#include "host/base/sha256.h"
#include "host/results/map_file.h"
#include "support/command_line.h"

using namespace wisp;

namespace {

// 16 batches, the last not full; colours, flux, and a smoke that glows.
struct MapCommandTest : CommandLineTest {
    MapCommandTest() {
        write("m.aff", scene());
        write("puff.vtk", puff(40));
    }
    static std::string scene(const std::string &box = "{ phase 0.1 emission 0.2 0.1 0 }",
                             const std::string &more = "") {
        return lit("box -1 -1 -1 1 1 1 0.15 " + box + "\nsmoke puff.vtk { radius 0.3 mass 1 extinction 0.001 }",
                   "render smoke map\nrender photons 65000\n" + more);
    }
    Ran render(const std::string &options) const { return wisp("render " + file("m.aff") + " " + options); }
    MapFile map(const std::string &name) const { return parse_map(read_file(file(name)), name); }
    // A map with the SHA-256 that is its own, whatever is in it.
    void forge(const std::string &name, const MapFile &map) { write(name, text(map_bytes(map))); }
    static std::string text(const Bytes &bytes) { return std::string(bytes.begin(), bytes.end()); }
    // The values of a counter, frame by frame.
    std::vector<std::string> counters(const std::string &name, const std::string &key) const {
        const std::string json = text_of(file(name)), head = "\"" + key + "\": ";
        std::vector<std::string> values;
        for (size_t at = json.find(head); at != std::string::npos; at = json.find(head, at + 1))
            values.push_back(
                json.substr(at + head.size(), json.find_first_of(", ", at + head.size()) - at - head.size()));
        return values;
    }
};

} // namespace

TEST_CASE("map command: traced in 1, 4 and 16 parts the map is one file, and one picture") {
    const MapCommandTest test;
    for (const std::string arithmetic : {"f32", "f64", "fixed"})
        for (const std::string deposit : {"exact", "path"}) {
            const std::string options = " --arith " + arithmetic + " --deposit " + deposit;
            CAPTURE(options);
            const std::string alone = test.render("--digest" + options).out;
            CHECK(alone.size() == 68);
            REQUIRE(test.render("--map-out " + test.file("whole.map") + " --batches 0:16" + options).status == 0);
            const Ran with_map = test.render("--digest --map-out " + test.file("again.map") + options);
            CHECK(with_map.out == alone);
            CHECK(test.same("again.map", "whole.map"));
            CHECK(test.map("whole.map").counts.emitted == 65000);
            for (int parts : {1, 4, 16}) {
                std::string list, turned;
                for (int i = 0; i < parts; ++i) {
                    const std::string name = test.file("p" + std::to_string(i) + ".map");
                    const Ran part =
                        test.render("--map-out " + name + options + " --batches " + std::to_string(16 / parts * i) +
                                    ":" + std::to_string(16 / parts * (i + 1)));
                    REQUIRE(part.status == 0);
                    CHECK((part.out + part.err).empty());
                    list += " " + name;
                    turned = " " + name + turned;
                }
                for (const std::string &order : {list, turned}) {
                    REQUIRE(test.wisp("merge" + order + " -o " + test.file("m.map")).status == 0);
                    CHECK(test.same("m.map", "whole.map"));
                }
                if (parts > 1) CHECK(!test.same("p0.map", "whole.map"));
                CHECK(test.render("--digest --map-in " + test.file("m.map") + options).out == alone);
            }
        }
}

TEST_CASE("map command: where smoke scatters forward, a map is of one view") {
    MapCommandTest test;
    const auto scene = [](const std::string &eye) {
        return "v from " + eye +
               " at 0 0 0 up 0 1 0 angle 40 hither 0.01 resolution 8 8\nlp 3 4 3 40 40 40\n"
               "smoke box -1 -1 -1 1 1 1 2 { phase 0.9 }\nrender photons 20000\n";
    };
    test.write("m.aff", scene("0 0 6"));
    const std::string alone = test.render("--digest").out;
    for (const std::string half : {"0:2", "2:5"})
        REQUIRE(test.render("--map-out " + test.file(half.substr(0, 1) + ".map") + " --batches " + half).status == 0);
    REQUIRE(test.wisp("merge " + test.file("0.map") + " " + test.file("2.map") + " -o " + test.file("m.map")).status ==
            0);
    CHECK(test.render("--digest --map-in " + test.file("m.map")).out == alone);
    test.write("m.aff", scene("1 0 6"));
    const Ran other = test.render("--digest --map-in " + test.file("m.map"));
    CHECK(other.status == 3);
    CHECK(other.err.find("and of this place of the eye") != std::string::npos);
    test.write("m.aff", scene("0 0 6") + "b 1 1 1\n"); // what else changes does not matter
    CHECK(test.render("--digest --map-in " + test.file("m.map")).status == 0);
}

TEST_CASE("map command: parts of parts, with gaps between them, merge as they come") {
    const MapCommandTest test;
    const auto trace = [&](const std::string &name, const std::string &batches) {
        REQUIRE(test.render("--map-out " + test.file(name) + " --batches " + batches).status == 0);
        return " " + test.file(name);
    };
    const auto merge = [&](const std::string &files, const std::string &name) {
        REQUIRE(test.wisp("merge" + files + " -o " + test.file(name)).status == 0);
        return " " + test.file(name);
    };
    const std::string a = trace("a.map", "0:3"), b = trace("b.map", "3:9"), c = trace("c.map", "9:16");
    const std::string gap = merge(c + a, "gap.map");
    CHECK(test.map("gap.map").batches == Ranges{{0, 3}, {9, 16}});
    merge(gap + b, "whole.map");
    trace("all.map", "0:16");
    CHECK(test.same("whole.map", "all.map"));
    merge(a, "one.map"); // of one: the same
    CHECK(test.same("one.map", "a.map"));
}

TEST_CASE("map command: other views of one map are those of photons traced for them") {
    MapCommandTest test;
    std::string other_camera = MapCommandTest::scene(); // and another background that is no brighter than the lights
    other_camera.replace(other_camera.find("0.5 0.5 6"), 9, "-3 0.5 4.");
    other_camera.replace(other_camera.find("b 0.1"), 5, "b 0.4");
    for (const std::string deposit : {" --deposit exact", ""}) {
        CAPTURE(deposit);
        const std::string map_in = " --map-in " + test.file("a.map") + deposit;
        test.write("m.aff", MapCommandTest::scene());
        REQUIRE(test.render("--map-out " + test.file("a.map") + deposit).status == 0);
        for (const std::string view :
             {"", "--size 11x5", "--crop 2,1,6,6", "--spp 3", "--step 0.25", "--irradiance adaptive"}) {
            const Ran traced = test.render(view + deposit + " --digest --stats " + test.file("t.json"));
            const Ran kept = test.render(view + map_in + " --digest --stats " + test.file("k.json"));
            CAPTURE(view);
            CHECK(kept.status == 0);
            CHECK(kept.err.empty());
            CHECK(kept.out == traced.out);
            CHECK(test.counters("k.json", "photons").size() == 3); // seconds, counts, and bytes
            CHECK(test.counters("k.json", "photons")[0] == "0.000000");
            const auto used = [&](const char *name) { // by the stage, its sums of photons among that
                const std::string json = text_of(test.file(name)), stage = "\"photons\": { \"planned\": ";
                const size_t at = json.find(stage);
                REQUIRE(at != std::string::npos);
                return std::stoull(json.substr(json.find("\"used\": ", at) + 8));
            };
            CHECK(used("t.json") >= std::stoull(test.counters("t.json", "particle_map")[0]));
            CHECK(used("k.json") >= std::stoull(test.counters("k.json", "particle_map")[0]));
            CHECK(test.counters("t.json", "photons")[0] != "0.000000");
            for (const char *count : {"emitted", "collisions", "stored", "absorbed", "escaped", "particle_map"})
                CHECK(test.counters("k.json", count) == test.counters("t.json", count));
        }
        const std::string plan = test.wisp("plan " + test.file("m.aff") + map_in).out;
        CHECK(plan.find("65000 photons of " + test.file("a.map") + ", kept " +
                        (deposit.empty() ? "at the bricks' nodes" : "on the particles")) != std::string::npos);
        test.write("m.aff", other_camera);
        const Ran traced = test.render("--digest" + deposit), kept = test.render("--digest" + map_in);
        if (!deposit.empty()) {
            CHECK(kept.out == traced.out);
            continue;
        }
        CHECK(kept.status == 3); // at nodes of exact smoke, photons are kept as it scatters them to the eye
        CHECK(kept.err.find("of this place of the eye: photons are kept as smoke scatters them to it\n") !=
              std::string::npos);
    }
}

TEST_CASE("map command: scenes that need no photons have maps too, with nothing in them") {
    MapCommandTest test;
    for (const std::string options : {"--photons 0", "--photons 100000"}) {
        test.write("m.aff", MapCommandTest::scene("{ albedo 0 0 0 }\nsmoke box 2 2 2 3 3 3 1 { albedo 0 0 0 }"));
        std::string text = text_of(test.file("m.aff"));
        text.replace(text.find("extinction 0.001"), 16, "albedo 0 0 0");
        test.write("m.aff", text);
        CAPTURE(options);
        const Ran out = test.render(options + " --digest --map-out " + test.file("n.map"));
        CHECK(out.status == 0);
        CHECK(test.map("n.map").sums.empty());
        CHECK(test.map("n.map").counts.emitted == 0);
        const Ran in = test.render(options + " --digest --map-in " + test.file("n.map"));
        CHECK(in.status == 0);
        CHECK(in.out == out.out);
    }
}

TEST_CASE("map command: a map that is not this scene's, or not whole, is refused in one line") {
    MapCommandTest test;
    const std::string a = test.file("a.map"), x = test.file("x.map");
    REQUIRE(test.render("--map-out " + a).status == 0);
    const MapFile whole = test.map("a.map");
    const auto refuses = [&](const std::string &options, const std::string &line) {
        CAPTURE(options);
        const Ran ran = test.render(options + " --digest -o " + test.file("x.pfm") + " --stats " + test.file("x.json"));
        test.refuses(ran, 3, line);
        CHECK(!test.has("x.pfm"));
        CHECK(!test.has("x.json"));
        test.refuses(test.wisp("plan " + test.file("m.aff") + " " + options), 3, line);
    };
    const std::string on_particles =
                          a + ": a map of another scene, other settings, arithmetic or version, expected the map "
                              "of this smoke and these lights, photons, seed, deposit, direction, cells and arithmetic",
                      other = on_particles +
                              ", and of this place of the eye: photons are kept as smoke scatters them to it";
    refuses("--deposit path --map-in " + a, on_particles);
    for (const std::string options : {"--photons 64999", "--seed 2", "--arith f64", "--arith fixed"})
        refuses(options + " --map-in " + a, other);
    for (const std::string box :
         {"{ phase 0.09 emission 0.2 0.1 0 }", "{ phase 0.1 emission 0.2 0.1 0.1 }",
          "{ phase 0.1 emission 0.2 0.1 0 extinction 1.1 }", "{ phase 0.1 emission 0.2 0.1 0 albedo 0.9 0.9 0.8 }"}) {
        test.write("m.aff", MapCommandTest::scene(box));
        refuses("--map-in " + a, other);
    }
    test.write("m.aff", MapCommandTest::scene("{ phase 0.1 emission 0.2 0.1 0 }", "lp -3 3 3 1 1 1\n"));
    refuses("--map-in " + a, other);
    std::string brighter = MapCommandTest::scene();
    brighter.replace(brighter.find("40 40 40"), 8, "80 80 80");
    test.write("m.aff", brighter);
    refuses("--map-in " + a, other);
    test.write("m.aff", MapCommandTest::scene());
    test.write("puff.vtk", CommandLineTest::puff(41));
    refuses("--map-in " + a, other);
    test.write("puff.vtk", CommandLineTest::puff(40));
    CHECK(test.render("--digest --map-in " + a).status == 0); // none of the above was in the way

    refuses("--map-in " + test.file("none.map"),
            test.file("none.map") + ": cannot be opened: No such file or directory");
    refuses("--map-in " + test.s(), test.s() + ":1: not a particle map, expected 'wisp map 1'");
    std::string text = text_of(a);
    text.back() = static_cast<char>(text.back() ^ 1);
    test.write("x.map", text);
    refuses("--map-in " + x, x + ":2: the file is damaged: its SHA-256 is another, expected " + text.substr(18, 64));
    test.write("x.map", text_of(a).substr(0, text.size() - 8));
    refuses("--map-in " + x, x + ":2: the file is damaged: its SHA-256 is another, expected " + text.substr(18, 64));

    MapFile map = whole;
    map.counts.emitted += 1;
    map.counts.escaped += 1;
    test.forge("x.map", map);
    refuses("--map-in " + x, x + ":6: counts that do not add up, expected those of the batches' photons");
    const std::string sums = " sums, expected those of this scene's map";
    map = whole;
    map.sums.push_back(0);
    test.forge("x.map", map);
    refuses("--map-in " + x, x + ": " + std::to_string(whole.sums.size() + 1) + sums);
    map.sums.clear();
    test.forge("x.map", map);
    refuses("--map-in " + x, x + ": 0" + sums);
    map = whole;
    map.sums.pop_back(); // only the core knows how many there must be at least
    test.forge("x.map", map);
    test.refuses(test.render("--digest --map-in " + x), 3, x + ": not as many sums as this scene's map has");

    REQUIRE(test.render("--map-out " + x + " --batches 0:15").status == 0);
    refuses("--map-in " + x, x + ": batches 0:15, expected 0:16; 'wisp merge' adds those of other files");
}

TEST_CASE("map command: sums that nobody traced do no harm") {
    MapCommandTest test;
    test.write("resampled.aff", MapCommandTest::lit("box -1 -1 -1 1 1 1 1.5 { phase 0.1 }"));
    for (const std::string scene : {"m.aff", "resampled.aff"})
        for (const std::string arithmetic : {"f32", "f64", "fixed"}) {
            const std::string render = "render " + test.file(scene) + " --arith " + arithmetic;
            REQUIRE(test.wisp(render + " --map-out " + test.file("a.map")).status == 0);
            MapFile map = test.map("a.map");
            for (size_t i = 0; i < map.sums.size(); ++i) map.sums[i] = i % 3 ? INT64_MIN : INT64_MAX;
            test.forge("x.map", map);
            CHECK(test.wisp(render + " --digest --map-in " + test.file("x.map")).status == 0);
        }
}

TEST_CASE("map command: options of the map are refused where they do nothing") {
    MapCommandTest test;
    const std::string a = test.file("a.map"), out = " --map-out " + a;
    const auto refuses = [&](const std::string &options, const std::string &line) {
        CAPTURE(options);
        test.refuses(test.render(options), 2, line);
        CHECK(!test.has("a.map"));
        CHECK(!test.has("x.pfm"));
    };
    for (const std::string method : {"--smoke direct ", "--reference "})
        for (const std::string &option :
             {"map-out " + a, "map-in " + a, std::string("batches 0:1"), std::string("remap")})
            refuses(method + "--" + option,
                    "option '" + option.substr(0, option.find(' ')) + "' belongs to --smoke map");
    for (const std::string &option : {"map-out " + a, std::string("batches 0:1"), std::string("remap")})
        refuses("--map-in x --" + option,
                "option '" + option.substr(0, option.find(' ')) + "' does not go with --map-in: nothing is traced");
    refuses("--batches 0:1", "option 'batches' makes no picture, expected --map-out with it");
    refuses("--batches 0:1 --digest" + out, "option 'digest' does not go with --batches: they make no picture");
    refuses("--batches 0:1 -o " + test.file("x.pfm") + out,
            "option 'output' does not go with --batches: they make no picture");
    refuses("--batches 1:17" + out,
            "option 'batches': found '1:17', expected batches below 16: those of 65000 photons");
    refuses("--photons 0 --batches 0:1" + out,
            "option 'batches': found '0:1', expected batches below 0: those of 0 photons");
    for (const std::string batches : {"2:2", "2:1", "1", "-1:2", "0:1:2", "a:b", "0:2147483648"})
        refuses("--batches " + batches + out, "");
    refuses("--frames 0:1" + out, "option 'map-out': found '" + a + "' for several frames, expected a name with %04d");
    refuses("-o " + a, "option 'output': found '" + a + "', expected --map-out for the particle map");
    refuses("-o " + test.file("x.pfm") + " --map-out " + test.file("x.pfm"),
            "option 'map-out' writes to '" + test.file("x.pfm") + "' like 'output', expected another file");
    for (const std::string option : {"map-out", "map-in"}) {
        test.write("m.aff", MapCommandTest::scene("{ }", "render " + option + " a.map"));
        test.refuses(test.render(""), 3,
                     test.file("m.aff") + ":12: option '" + option + "' in a scene, expected it on the command line");
    }
}

TEST_CASE("map command: photons that the sums might not hold are refused before any is traced") {
    const MapCommandTest test;
    const std::string photons = "--deposit exact --photons 9223372036854775807 ";
    const std::string found = "option 'photons': found 9223372036854775807, expected at most ",
                      expected = " that the particle map's sums can hold";
    for (const std::string command : {"render ", "plan "}) {
        const std::string scene = command + test.file("m.aff") + " " + photons;
        test.refuses(test.wisp(scene + "--digest"), 2, found + "68718476735" + expected);
        test.refuses(test.wisp(scene + "--digest --deposit path"), 2, found + "4293967295" + expected);
        test.refuses(test.wisp(scene + "--batches 0:1 --map-out " + test.file("a.map")), 2);
    }
    // As many as they hold are accepted; other methods have no such sums.
    CHECK(test.render("--deposit exact --photons 68718476735 --batches 0:1 --map-out " + test.file("a.map")).status ==
          0);
    CHECK(test.render(photons + "--digest --reference --passes 0:1").status == 0);
}

TEST_CASE("map command: frames with the same smoke use one map, unless --remap traces it anew") {
    MapCommandTest test;
    for (int i : {0, 1, 3}) test.write("q_" + std::to_string(i) + ".vtk", CommandLineTest::puff(30));
    test.write("q_2.vtk", CommandLineTest::puff(31));
    std::string text = MapCommandTest::scene();
    text.replace(text.find("puff.vtk"), 8, "q_%d.vtk");
    test.write("m.aff", text);
    const auto frames = [&](const std::string &options, const std::string &name) {
        return test.render("--frames 0:3 --digest -v --stats " + test.file(name) + " " + options);
    };
    const Ran kept = frames("", "k.json"), anew = frames("--remap", "a.json");
    CHECK(kept.status == 0);
    // Frame 1; 2 and 3 differ from those before.
    CHECK(kept.err == "the particle map is that of the frame before\nwrote " + test.file("k.json") + "\n");
    CHECK(anew.err == "wrote " + test.file("a.json") + "\n");
    CHECK(lines(kept.out) == 4);
    CHECK(kept.out == anew.out);
    // Of "photons", the seconds come first, the counts and the bytes behind them.
    const auto seconds = [&](const std::string &name, size_t frame) {
        return test.counters(name, "photons")[3 * frame];
    };
    for (size_t i = 0; i < 4; ++i) {
        CHECK((seconds("k.json", i) == "0.000000") == (i == 1));
        CHECK(seconds("a.json", i) != "0.000000");
    }
    CHECK(test.counters("k.json", "collisions") == test.counters("a.json", "collisions"));
    CHECK(test.counters("k.json", "emitted") == std::vector<std::string>(4, "65000"));

    // Saved and used frame by frame; a name without a number serves all frames that it fits.
    const std::string numbered = test.file("f_%02d.map");
    CHECK(frames("--map-out " + numbered, "o.json").out == kept.out);
    CHECK(test.same("f_00.map", "f_01.map"));
    CHECK(!test.same("f_00.map", "f_02.map"));
    CHECK(frames("--map-in " + numbered, "i.json").out == kept.out);
    for (size_t i = 0; i < 4; ++i) CHECK(seconds("i.json", i) == "0.000000");
    CHECK(test.render("--frames 0:1 --digest --map-in " + test.file("f_00.map")).out == kept.out.substr(0, 136));
    CHECK(test.render("--digest --frames 0:2 --map-in " + test.file("f_00.map")).status == 3);
    // Parts of each.
    const std::string part = test.file("h_%02d.map");
    CHECK(test.render("--frames 0:3 --batches 2:4 --map-out " + part).status == 0);
    CHECK(test.same("h_00.map", "h_01.map"));
    CHECK(!test.same("h_00.map", "h_02.map"));
    CHECK(test.map("h_03.map").batches == Ranges{{2, 4}});
}

TEST_CASE("map command: merge refuses maps that do not belong together, and writes nothing then") {
    MapCommandTest test;
    const auto trace = [&](const std::string &name, const std::string &options) {
        REQUIRE(test.render("--map-out " + test.file(name) + " --batches " + options).status == 0);
        return test.file(name);
    };
    const std::string a = trace("a.map", "0:2"), b = trace("b.map", "1:3"), c = trace("c.map", "4:5");
    const auto refuses = [&](const std::string &arguments, int status, const std::string &line = "",
                             const std::string &out = "x.map") {
        CAPTURE(arguments);
        test.refuses(test.wisp("merge " + arguments + " -o " + test.file(out)), status, line);
        for (const char *name : {"x.map", "x.pfm", "y.map"}) CHECK(!test.has(name));
    };
    const std::string usage = "maps are merged to a map, expected one --output and no other option with it";
    refuses("", 2, "found no file to merge, expected some .passes or .map");
    refuses(a + " " + c + " --digest", 2, usage);
    refuses(a + " " + c + " -o " + test.file("y.map"), 2, usage);
    refuses(a + " " + c + " -o " + test.file("x.pfm"), 2, usage);
    refuses(a + " " + c + " --error-out " + test.file("x.pfm"), 2, usage);
    refuses(a + " " + c + " --exposure 1", 2, usage);
    refuses(a + " " + c, 3, a + ":1: not a file of passes, expected 'wisp passes 1'", "x.pfm");
    refuses(a + " " + b, 3, b + ": batches 1:3, expected none of 0:2, which are there already");
    refuses(a + " " + c + " " + a, 3, a + ": batches 0:2, expected none of 0:2 4:5, which are there already");
    for (const std::string options : {"--seed 2", "--photons 65001", "--arith f64", "--deposit path"}) {
        const std::string other = trace("other.map", "4:5 " + options);
        CAPTURE(options);
        refuses(a + " " + other, 3,
                other + ": a map of another scene, other settings, arithmetic or version, expected the same");
    }
    test.write("m.aff", MapCommandTest::scene("{ phase 0.09 emission 0.2 0.1 0 }"));
    const std::string other = trace("other.map", "4:5");
    refuses(a + " " + other, 3,
            other + ": a map of another scene, other settings, arithmetic or version, expected the same");
    refuses(a + " " + test.file("none.map"), 3,
            test.file("none.map") + ": cannot be opened: No such file or directory");
    refuses(a + " " + test.s(), 3, test.s() + ":1: not a particle map, expected 'wisp map 1'");
    const std::string text = text_of(c);
    test.write("cut.map", text.substr(0, text.size() - 1));
    refuses(a + " " + test.file("cut.map"), 3,
            test.file("cut.map") + ":2: the file is damaged: its SHA-256 is another, expected " + text.substr(18, 64));
    MapFile forged = test.map("c.map"), first = test.map("a.map");
    first.sums[0] = forged.sums[0] = INT64_MAX;
    test.forge("first.map", first);
    test.forge("forged.map", forged);
    refuses(test.file("first.map") + " " + test.file("forged.map"), 3,
            test.file("forged.map") + ": its sums and those before are too large together, expected 63 bits at most");
    // Views do not part them.
    test.write("m.aff", "# again\n" + MapCommandTest::scene() + "\nrender step 0.25");
    CHECK(test.wisp("merge " + a + " " + trace("same.map", "4:5 --size 3x3 --spp 9") + " -o " + test.file("z.map"))
              .status == 0);
}

TEST_CASE("map command: a map that cannot be written ends with 5, before any picture") {
    const MapCommandTest test;
    std::filesystem::create_symlink("/dev/full", test.file("full.map"));
    const std::string none = test.file("none/a.map"), full = test.file("full.map");
    for (const std::string &path : {none, full}) {
        const std::string why = path == none ? "No such file or directory" : "No space left on device";
        test.refuses(test.render("--digest -o " + test.file("x.pfm") + " --map-out " + path), 5,
                     path + ": could not be written: " + why);
        CHECK(!test.has("x.pfm"));
        test.refuses(test.render("--batches 0:1 --map-out " + path), 5, path + ": could not be written: " + why);
    }
    REQUIRE(test.render("--batches 0:1 -v --map-out " + test.file("a.map")).err ==
            "wrote " + test.file("a.map") + "\n");
    test.refuses(test.wisp("merge " + test.file("a.map") + " -o " + none), 5,
                 none + ": could not be written: No such file or directory");
}
