// Runs that go on where others were stopped: what is kept and what is not, kills at any moment, signals.
#include "host/base/sha256.h"
#include "host/results/picture_record.h"
#include "support/built.h"
#include "support/command_line.h"
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <map>
#include <set>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

using namespace wisp;

namespace {

// An animation of a textured triangle before another that changes its form, in frames of pixels that cost little.
struct SequenceCommandTest : CommandLineTest {
    SequenceCommandTest() {
        write("tiles.ppm", "P6 2 1 255\n\1\2\3\4\5\6");
        write("still.aff", "f 1 1 1 0.5 0 0 0 1\nm vertices 3 -1 0 0 1 0 0 0 1.5 0 texturecoords 3 tiles.ppm 0 0 1 0 "
                           "0 1 triangles 1 0 1 2 0 1 2\n");
        write("t.aff", scene("2"));
    }
    static std::string scene(const std::string &end) {
        return "v from 0 1 6 at 0 0 0 up 0 1 0 angle 40 hither 0.1 resolution 80 60\nl 3 3 5\nb 0.2 0.3 0.4\n"
               "a 0 1 5\ni 0 still.aff\ntpa 2 0 0 0 -1 0 0 1 1 0 -1 0 0 1 0 1 -1 0 0 1 1 0 0 -1 0 0 1 " +
               end + " 0 -1 0 0 1 0 " + end + " -1 0 0 1\nrender spp 1\n";
    }
    std::string command(const std::string &options) const {
        return "render " + file("t.aff") + " -o " + file("f_%02d.pfm") + " -o " + file("f_%02d.png") + " -o " +
               file("f_%02d.exr") + " " + options;
    }
    Ran render(const std::string &options = "") const { return wisp(command(options)); }
    // How many frames were kept of all.
    int kept(const std::string &options = "") const { return kept_of(render(options)); }
    static int kept_of(const Ran &ran) {
        CHECK(ran.status == 0);
        int kept = 0, all = 0;
        std::string err = ran.err; // behind warnings
        while (err.rfind("wisp: warning: ", 0) == 0) err.erase(0, err.find('\n') + 1);
        if (std::sscanf(err.c_str(), "kept %d of %d frames", &kept, &all) == 2)
            CHECK(err == "kept " + std::to_string(kept) + " of " + std::to_string(all) +
                             " frames, which were there already\n");
        else
            CHECK(err.empty());
        return kept;
    }
    std::set<std::string> names() const {
        std::set<std::string> names;
        for (const auto &entry : std::filesystem::directory_iterator(file("")))
            names.insert(entry.path().filename().string());
        return names;
    }
    void flip(const std::string &name, size_t at) {
        std::string text = text_of(file(name));
        text.at(at) = static_cast<char>(text.at(at) ^ 1);
        write(name, text);
    }
};

// A run of its own that is given a signal.
class Process {
  public:
    Process(const CommandLineTest &test, const std::string &arguments) {
        const std::string command =
            "exec " + built("wisp") + " " + arguments + " > " + test.file("out") + " 2> " + test.file("err");
        id_ = fork();
        if (id_ == 0) {
            for (int number : {SIGINT, SIGTERM}) std::signal(number, SIG_DFL); // a background job ignores them
            execl("/bin/sh", "sh", "-c", command.c_str(), nullptr);
            _exit(127);
        }
    }
    ~Process() {
        if (id_ > 0) end(SIGKILL);
    }
    void signal(int number) const { kill(id_, number); }
    // The exit status, or 128 and the signal that ended it, as a shell says it.
    int wait() {
        int status = 0;
        waitpid(id_, &status, 0);
        id_ = -1;
        return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    }
    int end(int number) {
        signal(number);
        return wait();
    }
    // What it has used so far.
    double processor_seconds() const {
        clockid_t clock;
        timespec time = {};
        REQUIRE(clock_getcpuclockid(id_, &clock) == 0);
        REQUIRE(clock_gettime(clock, &time) == 0);
        return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
    }
    // Ended by the signal: the seconds that it has used since. A busy machine does not change them.
    double seconds_to_end(int number) {
        const double before = processor_seconds();
        signal(number);
        siginfo_t ended;
        REQUIRE(waitid(P_PID, static_cast<id_t>(id_), &ended, WEXITED | WNOWAIT) == 0);
        const double after = processor_seconds();
        CHECK(wait() == 128 + number);
        return after - before;
    }

  private:
    pid_t id_;
};

// Waits until a file holds something.
void await(const std::string &path, const std::string &text = "") {
    for (int i = 0; i < 60000; ++i) {
        std::error_code error;
        if (std::filesystem::file_size(path, error) > 0 && !error && text_of(path).find(text) != std::string::npos)
            return;
        usleep(500);
    }
    FAIL("nothing came");
}

} // namespace

TEST_CASE("sequence command: frames that are there are kept, others made, and the bits are the same") {
    SequenceCommandTest test;
    const Ran first = test.render("--digest");
    CHECK(first.err.empty());
    CHECK(lines(first.out) == 5);
    const std::set<std::string> all = test.names();
    CHECK(all.size() == 2 + 5 + 5 * 4); // puff.vtk and s.aff of every test; here, out and err
    const std::string last = text_of(test.file("f_04.png"));
    const Ran again = test.render("--digest");
    CHECK(test.kept_of(again) == 5);
    CHECK(again.out == first.out);
    CHECK(test.render("--digest -q").err.empty());
    // What is gone is made again.
    for (const char *name : {"f_01.pfm", "f_02.png", "f_02.exr", "f_04.pfm.wisp"})
        std::filesystem::remove(test.file(name));
    CHECK(test.kept() == 2);
    CHECK(test.names() == all);
    // What is not what was written, anywhere; what is half of it; and what follows it.
    for (const std::string name : {"f_01.pfm", "f_02.png", "f_03.exr", "f_04.pfm.wisp"}) {
        const std::string whole = text_of(test.file(name));
        CAPTURE(name);
        for (size_t at : {size_t{0}, size_t{30}, whole.size() / 2, whole.size() - 300, whole.size() - 40,
                          whole.size() - 14, whole.size() - 1}) {
            if (at >= whole.size()) continue;
            test.flip(name, at);
            CHECK(test.kept("--frames 1:4") == 3);
            CHECK(text_of(test.file(name)) == whole);
        }
        for (const std::string &wrong : {whole.substr(0, whole.size() / 2), whole + "\n", std::string(), whole + whole,
                                         whole.substr(0, 12), whole.substr(0, whole.size() - 1)}) {
            test.write(name, wrong);
            CHECK(test.kept("--frames 1:4") == 3);
            CHECK(text_of(test.file(name)) == whole);
        }
    }
    // A picture under the name of another frame, with its record.
    for (const char *kind : {".pfm", ".pfm.wisp", ".png", ".exr"})
        test.write(std::string("f_00") + kind, text_of(test.file(std::string("f_03") + kind)));
    CHECK(test.kept() == 4);
    CHECK(test.render("--digest").out == first.out);
    CHECK(text_of(test.file("f_04.png")) == last);
    // Frames apart are those of one run.
    for (int i = 0; i < 5; ++i) CHECK(test.kept("--frames " + std::to_string(i)) == 1);
}

TEST_CASE("sequence command: a frame is kept only for the same scene, options and version of the number system") {
    SequenceCommandTest test;
    CHECK(test.kept() == 0);
    for (const std::string option : {"--arith f64", "--arith fixed", "--size 81x60", "--spp 2", "--depth 3",
                                     "--shadows trace", "--lights cuts", "--seed 2", "--frame-count 6 --frames 1:3"}) {
        CAPTURE(option);
        CHECK(test.kept(option) == 0);
        CHECK(test.kept(option) == (option.find("frames") == std::string::npos ? 5 : 3));
        CHECK(test.kept() < 5);
    }
    // Only the .png shows it, yet a frame is kept as a whole.
    CHECK(test.kept("--exposure 1") == 0);
    CHECK(test.kept("--exposure 1") == 5);
    CHECK(test.kept() == 0);
    // What changes no pixel.
    for (const std::string option : {"--memory 1G", "--progress never", "--shadows exact", "--frame-count 5"})
        CHECK(test.kept(option) == 5);
    const std::string tiles = text_of(test.file("tiles.ppm")), still = text_of(test.file("still.aff"));
    test.write("still.aff", "# a comment\n" + still);
    CHECK(test.kept() == 5);
    test.write("still.aff", still + "s 0 0 0 0.1\n");
    CHECK(test.kept() == 0);
    test.flip("tiles.ppm", tiles.size() - 1);
    CHECK(test.kept() == 0);
    test.write("t.aff", SequenceCommandTest::scene("3")); // all but the first frame move
    CHECK(test.kept() == 1);
    // Others, where they are not several, are always made.
    const std::string one = "render " + test.file("t.aff") + " --frames 2 -o " + test.file("one.pfm");
    for (int i = 0; i < 2; ++i) CHECK(test.wisp(one).err.empty());
    CHECK(!test.has("one.pfm.wisp"));
}

TEST_CASE("sequence command: particles of a frame, and grids, are part of its scene") {
    CommandLineTest test;
    test.write("p_0.vtk", CommandLineTest::puff(20));
    test.write("p_1.vtk", CommandLineTest::puff(21));
    test.write("g.vol", CommandLineTest::volume(2, 1, 1, 1, 1, 1, {1, 0.5f}));
    test.write("p.aff",
               CommandLineTest::lit("p_%d.vtk { radius 0.2 mass 1 extinction 0.02 }\nsmoke g.vol { extinction 0.1 }"));
    const auto kept = [&](const std::string &options = "") {
        return SequenceCommandTest::kept_of(
            test.wisp("render " + test.file("p.aff") + " --frames 0:1 -o " + test.file("f_%d.png ") + options));
    };
    CHECK(kept() == 0);
    CHECK(kept() == 2);
    test.write("p_1.vtk", CommandLineTest::puff(22));
    CHECK(kept() == 1);
    CHECK(kept() == 2);
    test.write("g.vol", CommandLineTest::volume(2, 1, 1, 1, 1, 1, {1, 0.25f}));
    CHECK(kept() == 0);
    for (const std::string option :
         {"--photons 1000", "--smoke direct --irradiance none", "--step 0.25 --smoke direct", "--gather 10",
          "--gather-radius 1", "--reference --passes 0:2", "--reference --passes 1:3"}) {
        CAPTURE(option);
        CHECK(kept(option) == 0);
        CHECK(kept(option) == 2);
    }
    // Maps, errors and sums are made with the picture.
    for (const std::string &option : {"--smoke map --map-out " + test.file("m_%d.map"),
                                      "--reference --passes 0:2 --error-out " + test.file("e_%d.pfm"),
                                      "--reference --passes 0:2 -o " + test.file("e_%d.passes")})
        for (int i = 0; i < 2; ++i) CHECK(kept(option) == 0);
}

TEST_CASE("sequence command: digests and statistics of kept frames are true") {
    SequenceCommandTest test;
    const auto png = [&](const std::string &options) {
        return test.wisp("render " + test.file("t.aff") + " -o " + test.file("f_%02d.png ") + options);
    };
    const std::string stats = " --stats " + test.file("s.json");
    CHECK(SequenceCommandTest::kept_of(png("")) == 0);
    CHECK(SequenceCommandTest::kept_of(png("")) == 5);
    const Ran digests = png("--digest"); // which follow from no .png
    CHECK(SequenceCommandTest::kept_of(digests) == 0);
    CHECK(lines(digests.out) == 5);
    CHECK(SequenceCommandTest::kept_of(png(stats)) == 0);
    const auto digest_of = [&] {
        const std::string json = text_of(test.file("s.json"));
        return json.substr(json.find("\"digest\": "), 76);
    };
    const std::string whole = digest_of();
    CHECK(test.kept() == 0);
    std::filesystem::remove(test.file("f_03.pfm"));
    CHECK(test.kept(stats) == 4);
    CHECK(digest_of() == whole);
    const std::string json = text_of(test.file("s.json"));
    CHECK(json.find("{ \"frame\": 2, \"kept\": true },\n    { \"frame\": 3, \"seconds\": ") != std::string::npos);
    CHECK(test.kept(stats) == 5);
    CHECK(digest_of() == whole);
}

TEST_CASE("sequence command: frames of the paper's shadows are never kept, and carry no record") {
    const SequenceCommandTest test;
    CHECK(test.kept() == 0);
    CHECK(test.kept("--shadows paper") == 0);
    CHECK(test.kept("--shadows paper") == 0);
    CHECK(text_of(test.file("f_01.png")).find("tEXt") == std::string::npos);
    CHECK(test.kept() == 0);
}

TEST_CASE("sequence command: a .png with its record is a PNG, and the same pixels") {
    const SequenceCommandTest test;
    test.render("--frames 1");
    test.wisp("render " + test.file("t.aff") + " --frames 1 -o " + test.file("one.png"));
    const Bytes plain = read_file(test.file("one.png")), proved = read_file(test.file("f_01.png"));
    const auto big_endian = [](const uint8_t *b) {
        return uint32_t{b[0]} << 24 | uint32_t{b[1]} << 16 | uint32_t{b[2]} << 8 | b[3];
    };
    const auto chunks = [&](const Bytes &png) {
        std::vector<std::string> found;
        for (size_t at = 8; at < png.size();) {
            const uint32_t size = big_endian(&png[at]);
            REQUIRE(at + 12 + size <= png.size());
            CHECK(crc32(0, &png[at + 4], size + 4) == big_endian(&png[at + 8 + size]));
            found.emplace_back(png.begin() + static_cast<ptrdiff_t>(at + 4),
                               png.begin() + static_cast<ptrdiff_t>(at + 8 + size));
            at += 12 + size;
        }
        return found;
    };
    std::vector<std::string> expected = chunks(plain), found = chunks(proved);
    REQUIRE(expected.size() == 3);
    REQUIRE(found.size() == 4);
    CHECK(found[2].substr(0, 9) == std::string("tEXtwisp\0", 9));
    CHECK(found[2].find(sha256(plain.data(), plain.size()).text) != std::string::npos);
    found.erase(found.begin() + 2);
    CHECK(found == expected);
}

TEST_CASE("sequence command: killed at any moment, the next run goes on and leaves what one run leaves") {
    SequenceCommandTest test;
    test.write("out", "");
    test.write("err", "");
    const std::string options = "--digest --size 120x90";
    const auto clear = [&] {
        for (const std::string &name : test.names())
            if (name.compare(0, 2, "f_") == 0) std::filesystem::remove(test.file(name));
    };
    const Ran whole = test.render(options);
    REQUIRE(whole.status == 0);
    const std::set<std::string> all = test.names();
    std::map<std::string, std::string> contents;
    for (const std::string &name : all)
        if (name.compare(0, 2, "f_") == 0) contents[name] = text_of(test.file(name));
    uint32_t state = 1;
    int broken = 0;
    for (int i = 0; i < 20; ++i) {
        clear();
        Process process(test, test.command(options));
        state = state * 1664525u + 1013904223u;
        // Within the next milliseconds of a frame that was just begun, or of the program's start.
        if (i % 5 > 0) await(test.file("f_0" + std::to_string(i % 5 - 1) + ".pfm"));
        usleep(state >> 20); // up to 4 ms
        const int status = process.end(SIGKILL);
        CHECK((status == 0 || status == 128 + SIGKILL));
        broken += status != 0 && !test.has("f_04.png");
        for (const auto &[name, text] : contents) // whole, or not there
            if (test.has(name)) CHECK(text_of(test.file(name)) == text);
        const Ran next = test.render(options);
        CHECK(next.out == whole.out);
        CHECK(test.names() == all);
        for (const auto &[name, text] : contents) CHECK(text_of(test.file(name)) == text);
    }
    CHECK(broken > 0);
    // What a kill between two system calls leaves: all that may lie about, beside frames that are whole and are not.
    std::filesystem::remove(test.file("f_02.pfm"));
    for (const char *name : {"f_00.pfm", "f_01.png", "f_02.pfm", "f_02.pfm.wisp", "f_03.pfm.wisp"})
        test.write(std::string(name) + ".part", "half");
    const Ran next = test.render(options);
    CHECK(test.kept_of(next) == 4);
    CHECK(next.out == whole.out);
    CHECK(test.names() == all);
}

TEST_CASE("sequence command: after a signal it stops at a row, says so in one line and leaves nothing aside") {
    SequenceCommandTest test;
    const std::string slow = test.command("--frames 0:1 --size 64x600 --spp 4000 --progress always");
    for (const auto &[signal, name] : {std::pair<int, std::string>{SIGINT, "SIGINT"}, {SIGTERM, "SIGTERM"}}) {
        test.write("err", "");
        Process process(test, slow);
        await(test.file("err"));
        CHECK(process.end(signal) == 128 + signal);
        const std::string err = text_of(test.file("err"));
        CHECK(lines(err) == 1);
        CHECK(err.substr(err.rfind('\r') + 1) ==
              "wisp: error: " + test.file("t.aff") + ": stopped by " + name + " in frame 0\n");
        CHECK(test.tidy());
        CHECK(!test.has("f_00.pfm"));
    }
    // Photons stop at once.
    test.write("b.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 1.5 { }"));
    test.write("err", "");
    Process process(test, "render " + test.file("b.aff") +
                              " --smoke map --photons 400000000 --progress always --batches "
                              "0:90000 --map-out " +
                              test.file("b.map"));
    await(test.file("err"));
    CHECK(process.end(SIGTERM) == 128 + SIGTERM);
    CHECK(test.tidy());
    CHECK(!test.has("b.map"));
}

TEST_CASE("sequence command: a signal ends it soon in stages that would work for minutes") {
    SequenceCommandTest test;
    test.write("dense.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 500 { albedo 1 1 1 }"));
    test.write("thin.aff", CommandLineTest::lit("box -1 -1 -1 1 1 1 1 { albedo 1 1 1 }"));
    for (const auto &[options, stage] :
         {std::pair<std::string, std::string>{"dense.aff --spp 65536 --size 99x99", "camera rays"}, // random paths
          {"dense.aff --reference --spp 65536 --size 99x99", "camera rays"},
          {"thin.aff --smoke direct --irradiance uniform --irradiance-step 0.05 --photons 20000", "irradiance"},
          {"thin.aff --photons 400000000", "photons"},
          {"thin.aff --smoke direct --irradiance none --spp 65536 --size 99x99", "camera rays"}}) {
        CAPTURE(options);
        test.write("err", "");
        Process process(test, "render " + test.file(options) + " --progress always -o " + test.file("o.pfm"));
        await(test.file("err"), "frame 0: " + stage);
        CHECK(process.seconds_to_end(SIGTERM) < 5); // 0.02 are usual
        CHECK(text_of(test.file("err")).find(": stopped by SIGTERM in frame 0\n") != std::string::npos);
        CHECK(test.tidy());
        CHECK(!test.has("o.pfm"));
    }
}

TEST_CASE("sequence command: a signal ends it while it reads, with the same line") {
    SequenceCommandTest test;
    test.write("r.aff", CommandLineTest::lit(test.file("smoke.ply") + " { }"));
    for (const char *pipe : {"smoke.ply", "scene.aff", "part.pfm", "part.pfm.wisp", "part.passes"})
        REQUIRE(mkfifo(test.file(pipe).c_str(), 0600) == 0);
    for (const auto &[signal, name] : {std::pair<int, std::string>{SIGINT, "SIGINT"}, {SIGTERM, "SIGTERM"}}) {
        for (const std::string reading : {"smoke.ply", "scene.aff"})
            for (const std::string command : {"render", "plan", "inspect"}) {
                CAPTURE(command + ": " + reading);
                const std::string scene = test.file(reading == "scene.aff" ? reading : "r.aff");
                Process process(test, command + " " + scene +
                                          (command == "render"    ? " -o " + test.file("r.pfm")
                                           : command == "inspect" ? " 1 1"
                                                                  : ""));
                const int pipe = open(test.file(reading).c_str(), O_WRONLY | O_CLOEXEC); // it reads; nothing comes
                CHECK(process.end(signal) == 128 + signal);
                close(pipe);
                CHECK(text_of(test.file("err")) == "wisp: error: " + scene + ": stopped by " + name +
                                                       (scene == test.file(reading) ? "\n" : " in frame 0\n"));
                CHECK(!test.has("r.pfm"));
            }
        for (const std::string command : {"compare", "merge", "stitch"}) {
            CAPTURE(command);
            const std::string part = test.file(command == "merge" ? "part.passes" : "part.pfm");
            Process process(test,
                            command + " " + part + (command == "compare" ? " " + part : " -o " + test.file("r.pfm")));
            // The record beside a part is read first.
            const int pipe = open((command == "stitch" ? part + ".wisp" : part).c_str(), O_WRONLY | O_CLOEXEC);
            CHECK(process.end(signal) == 128 + signal);
            close(pipe);
            CHECK(text_of(test.file("err")) == "wisp: error: " + command + ": stopped by " + name + "\n");
            CHECK(!test.has("r.pfm"));
        }
    }
}
