// vdb_to_nvdb FILE.vdb: writes the float grids of an OpenVDB file to standard output, as a NanoVDB file. Where that
// fails it writes the reason instead, and exits 3.
#include <iostream>
#include <nanovdb/util/IO.h>
#include <nanovdb/util/OpenToNanoVDB.h>
#include <openvdb/openvdb.h>
#include <sstream>
#include <vector>

namespace {

std::string one_line(std::string text) {
    for (char &c : text)
        if (c == '\n' || c == '\r') c = ' ';
    return text;
}

int fail(const std::string &reason) {
    std::cout << one_line(reason);
    return 3;
}

} // namespace

int main(int count, char **words) try {
    if (count != 2) return fail("found no file, expected one .vdb");
    openvdb::initialize();
    openvdb::io::File file(words[1]);
    file.open(false); // whole, not by need
    std::vector<nanovdb::GridHandle<nanovdb::HostBuffer>> grids;
    std::string others;
    for (auto name = file.beginName(); name != file.endName(); ++name) {
        const openvdb::GridBase::Ptr grid = file.readGrid(name.gridName());
        const bool linear = grid->transform().isLinear(); // not a camera's frustum
        if (const auto floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid); floats && linear)
            grids.push_back(nanovdb::openToNanoVDB(*floats));
        else
            others += (others.empty() ? "" : ", ") + name.gridName() + " (" + grid->valueType() +
                      (linear ? ")" : ", in a frustum)");
    }
    if (grids.empty())
        return fail("no float grid of linear steps, expected one" + (others.empty() ? "" : "; it has " + others));
    // NanoVDB's writer comes back to the header, for which a stream in memory must have room from the start.
    nanovdb::io::Segment header;
    for (auto &grid : grids) header.add(grid);
    std::ostringstream bytes(std::string(header.memUsage(), '\0'));
    nanovdb::io::writeGrids<nanovdb::HostBuffer, std::vector>(bytes, grids, nanovdb::io::Codec::NONE);
    std::cout << bytes.str();
    return std::cout.flush() ? 0 : 1;
} catch (const std::exception &error) {
    return fail(error.what() + std::string(", expected a sound .vdb file"));
}
