// build/wisp as a user meets it, in a folder with a small scene.
#pragma once
#include "host/base/files.h"
#include "support/built.h"
#include "support/data.h"
#include "support/temporary_folder.h"
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <fstream>
#include <regex>
#include <sys/wait.h>

namespace wisp {

struct Ran {
    int status;
    std::string out, err;
};

// Warnings but for those of photons' noise: tests have fewer photons than scenes.
inline std::string without_noise(const std::string &warnings) {
    return std::regex_replace(warnings, std::regex("[^\n]* wrong here, by noise of [^\n]*\n"), "");
}

inline std::string text_of(const std::string &path) {
    const Bytes bytes = read_file(path);
    return std::string(bytes.begin(), bytes.end());
}

inline size_t lines(const std::string &text) { return static_cast<size_t>(std::count(text.begin(), text.end(), '\n')); }

struct CommandLineTest : TemporaryFolder {
    CommandLineTest() {
        write("puff.vtk", puff(40));
        write("s.aff", scene("puff.vtk", ""));
    }
    void write(const std::string &name, const std::string &text) {
        std::ofstream(file(name), std::ios::binary) << text;
    }
    // A small ball of particles as ASCII VTK.
    static std::string puff(int count) {
        std::string text =
            "# vtk DataFile Version 3.0\npuff\nASCII\nDATASET POLYDATA\nPOINTS " + std::to_string(count) + " float\n";
        uint32_t state = 9;
        for (int i = 0; i < 3 * count; ++i) {
            state = state * 1664525u + 1013904223u;
            text += std::to_string((state >> 8) * 0x1p-24 - 0.5) + " ";
        }
        return text + "\n";
    }
    static std::string scene(const std::string &particles, const std::string &more) {
        return "v from 0 0 4 at 0 0 0 up 0 1 0 angle 30 hither 1 resolution 16 12\nb 0.1 0.1 0.2\nlp 3 3 3 40 40 "
               "40\nsmoke " +
               particles + " {\n radius 0.2\n mass 1\n extinction 0.02\n}\nrender photons 3000\nrender gather 20\n" +
               more;
    }
    Ran wisp(const std::string &arguments) const { return run(built("wisp") + " " + arguments); }
    // Where the process may map so many kilobytes.
    Ran wisp_within(int kilobytes, const std::string &arguments) const {
        return run("ulimit -v " + std::to_string(kilobytes) + "; " + built("wisp") + " " + arguments);
    }
    Ran run(const std::string &words) const {
        const std::string command = "{ " + words + "; } > " + file("out") + " 2> " + file("err");
        const int status = std::system(command.c_str());
        return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(file("out")), text_of(file("err"))};
    }
    std::string s() const { return file("s.aff"); }

    // A box between two lights, small enough for paths.
    static std::string lit(const std::string &smoke, const std::string &more = "") {
        return "v from 0.5 0.5 6 at 0 0 0 up 0 1 0 angle 35 hither 1 resolution 9 7\nb 0.1 0.1 0.2\nlp 3 3 3 40 40 "
               "40\nld 1 -1 0 1 2 3\nsmoke " +
               smoke + "\nrender spp 1\nrender photons 2000\nrender gather 20\n" + more;
    }
    // A density grid of nx x ny x nz samples in the box from -(x, y, z) to (x, y, z).
    static std::string volume(int nx, int ny, int nz, float x, float y, float z, const std::vector<float> &samples) {
        std::string bytes = "VOL\3";
        const auto put = [&bytes](auto number) {
            char raw[4];
            static_assert(sizeof number == 4, "as in the file");
            std::memcpy(raw, &number, 4);
            bytes.append(raw, 4);
        };
        for (int number : {1, nx, ny, nz, 1}) put(number);
        for (float number : {-x, -y, -z, x, y, z}) put(number);
        for (float number : samples) put(number);
        return bytes;
    }
    bool has(const std::string &name) const { return std::filesystem::exists(file(name)); }
    // No file that was to be renamed lies about.
    bool tidy() const {
        for (const auto &entry : std::filesystem::directory_iterator(file("")))
            if (entry.path().extension() == ".part") return false;
        return true;
    }
    bool same(const std::string &a, const std::string &b) const { return read_file(file(a)) == read_file(file(b)); }
    // `PLACE: TEXT` of `PLACE: error: TEXT`, `TEXT` of `wisp: error: TEXT`.
    static std::string without_severity(const std::string &err) {
        const std::string error = "error: ";
        const size_t at = std::min(err.find(error), err.size());
        const std::string place = err.substr(0, at);
        return (place == "wisp: " ? "" : place) + err.substr(std::min(at + error.size(), err.size()));
    }
    // `line`: as without_severity().
    void refuses(const Ran &ran, int status, const std::string &line = "") const {
        CHECK(ran.status == status);
        CHECK(lines(ran.err) == 1);
        CHECK(ran.out.empty());
        CHECK(ran.err.find(": error: ") != std::string::npos);
        if (!line.empty()) CHECK(without_severity(ran.err) == line + "\n");
        CHECK(tidy());
    }
};

} // namespace wisp
