// Recognises the formats, and has the rules that they share.
#include "host/base/files.h"
#include "host/base/gzip.h"
#include "host/base/memory.h"
#include "host/formats/particle_readers.h"
#include "host/formats/particles.h"
#include <algorithm>
#include <cmath>
#include <iterator>

namespace wisp {
namespace {

struct Format {
    std::string_view magic;
    const char *suffix, *description;
    Encoding encoding;
    Particles (*parse)(ByteReader &);
};
constexpr Format formats[] = {
    {"# vtk DataFile Version", ".vtk", "legacy VTK", Encoding::text, parse_vtk},
    {"Bgeo", ".bgeo", "BGEO", Encoding::big_endian, parse_bgeo},
    {"ply", ".ply", "PLY", Encoding::text, parse_ply},
};

// Related formats that are not read, and how to convert them.
struct Stranger {
    std::string_view magic;
    const char *message;
};
constexpr Stranger strangers[] = {
    {"\x7fNSJ", "a new JSON bgeo, expected BGEO version 5: save as .bhclassic"},
    {"PGEOMETRY", "a text geo, expected BGEO version 5: save as .bhclassic"},
    {"<?xml", "an XML file, expected legacy VTK: save as .vtk"},
    {"<VTKFile", "an XML VTK file, expected legacy VTK: save as .vtk"},
};

// In the table, with every attribute.
constexpr uint64_t bytes_of_point = sizeof(Particles::position[0]) + 3 * sizeof(double);

std::string name_of(Column column) {
    constexpr const char *names[] = {"x", "y", "z", "density", "mass", "smoothing length"};
    return names[static_cast<size_t>(column)];
}

bool starts_with(std::string_view text, std::string_view start) { return text.substr(0, start.size()) == start; }
bool ends_with(std::string_view text, std::string_view end) {
    return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

[[noreturn]] void fail_unknown(const std::string &name, std::string_view content) {
    const std::string start = name + ": byte 0";
    for (const Stranger &stranger : strangers)
        if (starts_with(content, stranger.magic)) throw InputError(start, stranger.message);
    for (const Format &format : formats)
        if (ends_with(lower_case(name), format.suffix))
            throw InputError(start, std::string("not a ") + format.description + " file, expected '" +
                                        std::string(format.magic) + "' at its start");
    throw InputError(start, "not a particle file, expected legacy VTK, BGEO version 5 or PLY");
}

} // namespace

Column ParticleBuilder::claim(std::string_view attribute) {
    const std::string name = lower_case(attribute);
    if (name == "radius" || name == "pscale") particles_.has_particle_radius = true;
    if (name == "density") return claim(Column::density);
    if (name == "mass") return claim(Column::mass);
    if (name == "h" || name == "smoothing_length") return claim(Column::smoothing_length);
    return Column::unused;
}

Column ParticleBuilder::claim(Column column) {
    bool &claimed = claimed_[static_cast<size_t>(column)];
    if (claimed) reader_.fail(name_of(column) + " again, expected it only once");
    claimed = true;
    return column;
}

std::vector<double> &ParticleBuilder::values(Column column) {
    if (column == Column::density) return particles_.density;
    return column == Column::mass ? particles_.mass : particles_.smoothing_length;
}

void ParticleBuilder::set_count(size_t count) {
    require_memory(reader_.name(), std::to_string(count) + " points", count * bytes_of_point);
    particles_.position.resize(count);
    for (Column column : {Column::density, Column::mass, Column::smoothing_length})
        if (is_claimed(column)) values(column).resize(count);
}

void ParticleBuilder::store(Column column, size_t particle, double value) {
    if (column == Column::unused) return;
    const char *expected = nullptr;
    if (!std::isfinite(value))
        expected = "a finite number";
    else if (column == Column::mass && value < 0)
        expected = "0 or more";
    else if (column == Column::smoothing_length && value <= 0)
        expected = "more than 0";
    if (expected) {
        char text[32]; // the longest double takes 24
        const double printed = std::isnan(value) ? std::abs(value) : value;
        const char *end = std::to_chars(text, text + sizeof text, printed).ptr;
        reader_.fail(name_of(column) + " of point " + std::to_string(particle) + " is " +
                     std::string(text, end - text) + ", expected " + expected);
    }
    if (column <= Column::z)
        particles_.position[particle][static_cast<size_t>(column)] = value;
    else
        values(column)[particle] = value;
}

Particles read_particles(const std::string &path) {
    const Bytes bytes = read_file(path);
    return parse_particles(path, bytes.data(), bytes.size());
}

Particles parse_particles(const std::string &name, const unsigned char *data, size_t size) {
    Bytes inflated;
    if (is_gzip(data, size)) {
        inflated = gunzip(name, data, size);
        data = inflated.data();
        size = inflated.size();
    }
    const std::string_view content(reinterpret_cast<const char *>(data), size);
    for (const Format &format : formats)
        if (starts_with(content, format.magic)) {
            ByteReader reader(name, data, size, format.encoding);
            Particles particles = format.parse(reader);
            particles.format = format.description;
            return particles;
        }
    fail_unknown(name, content);
}

bool is_particles(const unsigned char *data, size_t size) {
    const std::string_view content(reinterpret_cast<const char *>(data), size);
    const auto begins = [content](const auto &kind) { return starts_with(content, kind.magic); };
    return is_gzip(data, size) || std::any_of(std::begin(formats), std::end(formats), begins) ||
           std::any_of(std::begin(strangers), std::end(strangers), begins);
}

} // namespace wisp
