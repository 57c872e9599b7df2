// OpenVDB files, as OpenVDB's own tools write them.
#include "support/command_line.h"
#include "support/data.h"

using namespace wisp;

TEST_CASE_FIXTURE(CommandLineTest,
                  "an OpenVDB file is rendered, and what is not smoke or damaged is refused in a line") {
    if (!std::filesystem::exists(built("vdb_to_nvdb")))
        return skip_case("there is no vdb_to_nvdb: install libopenvdb-dev");
    if (run("command -v vdb_tool").status != 0) return skip_case("there is no vdb_tool: install libopenvdb-tools");
    // vdb_tool ends with 1 even where it has written its file.
    run("vdb_tool -sphere d=20 r=1.5 -ls2fog -write " + file("fog.vdb") + "; vdb_tool -sphere d=20 -write " +
        file("set.vdb") + "; vdb_tool -sphere d=20 r=1.5 -ls2fog -write " + file("fog.nvdb"));
    const std::string options = " --photons 500 --size 16x16 -q -o ";
    CHECK(wisp("render " + file("fog.vdb") + options + file("a.pfm")).status == 0);
    CHECK(wisp("render " + file("fog.nvdb") + options + file("b.pfm")).status == 0);
    CHECK(text_of(file("a.pfm")) == text_of(file("b.pfm")));
    const auto refused = [&](const std::string &name, const std::string &text) {
        const Ran ran = wisp("render " + file(name) + options + file("c.pfm"));
        CHECK(ran.status == 3);
        CHECK(lines(ran.err) == 1);
        CHECK(ran.err.find(text) != std::string::npos);
    };
    refused("set.vdb", "is a level set: distances to a surface, expected a fog volume");
    // Installed, vdb_to_nvdb lies in a folder of its own.
    for (const char *folder : {"bin", "libexec/wisp"}) std::filesystem::create_directories(file(folder));
    std::filesystem::copy(built("wisp"), file("bin/wisp"));
    refuses(run(file("bin/wisp") + " info " + file("fog.vdb")), 3);
    std::filesystem::copy(built("vdb_to_nvdb"), file("libexec/wisp/vdb_to_nvdb"));
    CHECK(run(file("bin/wisp") + " info " + file("fog.vdb")).status == 0);
    const std::string whole = text_of(file("fog.vdb"));
    for (size_t size = 8; size < whole.size(); size += 1 + whole.size() / 9) {
        write("cut.vdb", whole.substr(0, size));
        refused("cut.vdb", ", expected ");
    }
}
