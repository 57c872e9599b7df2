// Particle files: every format and version gives the same table, and bad files give one clear line.
#include "host/base/error.h"
#include "host/base/gzip.h"
#include "host/formats/particles.h"
#include "support/data.h"
#include "support/refusal.h"
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <doctest/doctest.h>
#include <filesystem>
#include <limits>
#include <zlib.h>

extern "C" int fuzz_particles(const uint8_t *data, size_t size); // test/fuzz/particles_fuzz.cpp

using namespace wisp;

namespace {

// --- files made here -----------------------------------------------------------------------------------------------

template <class Number> std::string packed(Number number, bool big_endian = true) {
    char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    const uint16_t one = 1;
    const bool host_is_big = *reinterpret_cast<const char *>(&one) == 0;
    if (big_endian != host_is_big) std::reverse(bytes, bytes + sizeof number);
    return std::string(bytes, sizeof number);
}

std::string printed(double number) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", number);
    return text;
}

float float_of_bits(uint32_t bits) {
    float number;
    std::memcpy(&number, &bits, sizeof number);
    return number;
}

// Four particles of 32-bit floats. The packed first coordinate begins with the byte of a line end, the first mass and
// the first h with a blank: nothing may be skipped there.
const Particles &sample() {
    static const Particles particles = [] {
        Particles p;
        p.position = {{float_of_bits(0x0a0a200a), 0.1f, -2.5f}, {1, 2, 3}, {-1e-3f, 1e30f, 0}, {0.3f, 0.7f, -0.0f}};
        p.density = {1000.25, 0, -3.5f, 0.1f};
        p.mass = {float_of_bits(0x200d0a20), 0, 0.02f, 7};
        p.smoothing_length = {float_of_bits(0x20202020), 0.1f, 2, 1e-20f};
        return p;
    }();
    return particles;
}

void check_equal(const Particles &a, const Particles &b) {
    CHECK(a.position == b.position);
    CHECK(a.density == b.density);
    CHECK(a.mass == b.mass);
    CHECK(a.smoothing_length == b.smoothing_length);
    CHECK(a.has_particle_radius == b.has_particle_radius);
}

Particles parse(const std::string &content) {
    return parse_particles("file", reinterpret_cast<const unsigned char *>(content.data()), content.size());
}

std::string error_of(const std::string &content) {
    return refusal_of([&] { parse(content); });
}

struct VtkStyle {
    std::string version = "4.1", dataset = "UNSTRUCTURED_GRID", line_end = "\n";
    bool binary = false, doubles = false, metadata = false, lookup_table = true, cell_data = false,
         surplus_arrays = false;
};

class VtkFile {
  public:
    VtkFile(const VtkStyle &style, const Particles &particles) : style_(style) {
        const std::string n = std::to_string(particles.position.size());
        line("# vtk DataFile Version " + style.version);
        line("POINTS 7 float is only the title");
        line(style.binary ? "BINARY" : "ASCII");
        if (style.metadata) line("");
        line("DATASET " + style.dataset);
        line("FIELD FieldData 1");
        line("TIME 1 1 double");
        number<double>(0.5);
        end_array();
        line("POINTS " + n + " " + real());
        for (const auto &point : particles.position) reals(point.data(), 3);
        end_array();
        metadata();
        topology(particles.position.size());
        if (style.cell_data) attributes(particles, "CELL_DATA " + n, 2);
        attributes(particles, "POINT_DATA " + n, 1);
    }
    std::string text;

  private:
    void line(const std::string &words) { text += words + style_.line_end; }
    template <class Number> void number(Number value) {
        if (style_.binary)
            text += packed(value);
        else
            text += printed(static_cast<double>(value)) + " ";
    }
    void reals(const double *values, size_t count) {
        for (size_t i = 0; i < count; ++i)
            if (style_.doubles)
                number(values[i]);
            else
                number(static_cast<float>(values[i]));
        if (!style_.binary) line("");
    }
    template <class Number> void repeat(size_t count, Number value) {
        for (size_t i = 0; i < count; ++i) number(value);
    }
    void end_array() { line(""); }
    std::string real() const { return style_.doubles ? "double" : "float"; }
    void metadata() {
        if (!style_.metadata) return;
        for (const char *words :
             {"METADATA", "INFORMATION 1", "NAME L2_NORM_RANGE LOCATION vtkDataArray", "DATA 2 0 1"})
            line(words);
        line("");
    }
    void topology(size_t n) {
        const std::string name = style_.dataset == "POLYDATA" ? "VERTICES " : "CELLS ";
        if (style_.version[0] == '5') {
            line(name + std::to_string(n + 1) + " " + std::to_string(n));
            line("OFFSETS vtktypeint64");
            repeat<int64_t>(n + 1, 10);
            end_array();
            line("CONNECTIVITY vtktypeint64");
            repeat<int64_t>(n, 13);
        } else {
            line(name + std::to_string(n) + " " + std::to_string(2 * n));
            repeat<int32_t>(2 * n, 32);
        }
        end_array();
        if (style_.dataset == "POLYDATA") return;
        line("CELL_TYPES " + std::to_string(n));
        repeat<int32_t>(n, 1);
        end_array();
    }
    void attributes(const Particles &particles, const std::string &keyword, double factor) {
        const size_t n = particles.position.size();
        line(keyword);
        line("VECTORS velocity " + real());
        repeat<float>(style_.doubles ? 0 : 3 * n, 0.25f);
        repeat<double>(style_.doubles ? 3 * n : 0, 0.25);
        end_array();
        line("SCALARS id unsigned_int 1");
        line("LOOKUP_TABLE id_table");
        repeat<uint32_t>(n, 10);
        end_array();
        line("LOOKUP_TABLE id_table 2");
        if (style_.binary)
            text += std::string(8, '\n');
        else
            repeat<float>(8, 1);
        end_array();
        line("SCALARS Mass " + real());
        if (style_.lookup_table) line("LOOKUP_TABLE default");
        scaled(particles.mass, factor);
        line("FIELD FieldData " + std::string(style_.surplus_arrays ? "7" : "4"));
        array("mass_flow", "3");
        repeat<int16_t>(3 * n, 8224);
        end_array();
        metadata();
        array("DENSITY", "1");
        scaled(particles.density, factor);
        metadata();
        array("h", "3");
        repeat<int16_t>(3 * n, 8224);
        end_array();
        array("smoothing_length", "1");
        scaled(particles.smoothing_length, factor);
        metadata();
    }
    void array(const std::string &name, const std::string &components) {
        line(name + " " + components + " 4 " + (components == "1" ? real() : "short"));
    }
    void scaled(const std::vector<double> &values, double factor) {
        for (double value : values) {
            const double product = value * factor;
            reals(&product, 1);
        }
        end_array();
    }

    const VtkStyle &style_;
};

std::string vtk(const VtkStyle &style) { return VtkFile(style, sample()).text; }

std::string bgeo_string(const std::string &text) { return packed(static_cast<uint16_t>(text.size())) + text; }

// `attributes` definitions, then the points.
std::string bgeo_header(int32_t points, int32_t attributes, int32_t version = 5) {
    std::string text = "BgeoV" + packed(version) + packed(points);
    for (int32_t count : {1, 0, 0, attributes, 0, 1, 0}) text += packed(count);
    return text;
}

std::string bgeo_attribute(const std::string &name, uint16_t components, int32_t type) {
    return bgeo_string(name) + packed(components) + packed(type);
}

// The sample, with an indexed string, a vector, an integer and a particle radius among the attributes.
std::string bgeo() {
    const Particles &p = sample();
    std::string text = bgeo_header(4, 7);
    text += bgeo_attribute("kind", 1, 4) + packed(int32_t{2}) + bgeo_string("smoke") + bgeo_string("");
    text += bgeo_attribute("density", 1, 0) + packed(0.0f);
    text += bgeo_attribute("v", 3, 5) + packed(0.0f) + packed(0.0f) + packed(0.0f);
    text += bgeo_attribute("Mass", 1, 0) + packed(0.0f);
    text += bgeo_attribute("id", 1, 1) + packed(int32_t{0});
    text += bgeo_attribute("h", 1, 0) + packed(0.0f);
    text += bgeo_attribute("pscale", 1, 0) + packed(0.0f);
    for (size_t i = 0; i < 4; ++i) {
        for (double x : p.position[i]) text += packed(static_cast<float>(x));
        text += packed(1.0f) + packed(int32_t{1});
        text += packed(static_cast<float>(p.density[i]));
        text += packed(1.0f) + packed(2.0f) + packed(3.0f);
        text += packed(static_cast<float>(p.mass[i])) + packed(static_cast<int32_t>(i));
        text += packed(static_cast<float>(p.smoothing_length[i])) + packed(0.5f);
    }
    return text;
}
constexpr size_t bgeo_tail_size = 6;
std::string bgeo_with_tail() { return bgeo() + std::string("\0\1abc\xff", bgeo_tail_size); }

std::string gzip(const std::string &content, const char *file_name = nullptr) {
    z_stream stream{};
    REQUIRE(deflateInit2(&stream, 9, Z_DEFLATED, 15 + 16, 9, Z_DEFAULT_STRATEGY) == Z_OK);
    gz_header header{};
    std::string name = file_name ? file_name : "";
    header.name = file_name ? reinterpret_cast<unsigned char *>(&name[0]) : nullptr;
    header.hcrc = 1;
    deflateSetHeader(&stream, &header);
    std::string result(deflateBound(&stream, content.size()) + 100, '\0');
    std::string input = content;
    stream.next_in = reinterpret_cast<unsigned char *>(&input[0]);
    stream.avail_in = static_cast<unsigned>(input.size());
    stream.next_out = reinterpret_cast<unsigned char *>(&result[0]);
    stream.avail_out = static_cast<unsigned>(result.size());
    REQUIRE(deflate(&stream, Z_FINISH) == Z_STREAM_END);
    result.resize(stream.total_out);
    deflateEnd(&stream);
    return result;
}

enum class PlyFormat { ascii, little, big };

// The sample, with properties in another order and of several types, after elements with lists; `line_end` is the
// header's.
std::string ply(PlyFormat format, const std::string &line_end = "\n") {
    const Particles &p = sample();
    const bool text = format == PlyFormat::ascii, big = format == PlyFormat::big;
    std::string out = "ply" + line_end + "format ";
    out += text ? "ascii" : big ? "binary_big_endian" : "binary_little_endian";
    out += " 1.0" + line_end;
    for (const char *words : {"comment element vertex 9",
                              "obj_info end_header",
                              "element face 2",
                              "property list uchar uint vertex_indices",
                              "property float32 weight",
                              "property list int16 double corner",
                              "element nothing 5",
                              "element vertex 4",
                              "property float64 z",
                              "property uint8 red",
                              "property float mass",
                              "property float y",
                              "property list uint short h",
                              "property double H",
                              "property int8 quality",
                              "property float x",
                              "property float Density",
                              "property float nx",
                              "element edge 1000",
                              "property int vertex1",
                              "end_header"})
        out += words + line_end;
    const std::string row_end = text ? line_end : "";
    const auto put = [&](auto number) {
        out += text ? printed(static_cast<double>(number)) + " " : packed(number, big);
    };
    for (uint8_t corners : {3, 0}) {
        put(corners);
        for (uint32_t i = 0; i < corners; ++i) put(i);
        put(0.5f);
        put(int16_t{1});
        put(0.25);
        out += row_end;
    }
    for (size_t i = 0; i < 4; ++i) {
        put(p.position[i][2]);
        put(uint8_t{10});
        put(static_cast<float>(p.mass[i]));
        put(static_cast<float>(p.position[i][1]));
        put(static_cast<uint32_t>(i));
        for (size_t k = 0; k < i; ++k) put(int16_t{-7});
        put(p.smoothing_length[i]);
        put(int8_t{32});
        put(static_cast<float>(p.position[i][0]));
        put(static_cast<float>(p.density[i]));
        put(0.0f);
        out += row_end;
    }
    return out;
}

std::string ply_of(const std::string &rows, const std::string &vertices = "1", const std::string &more = "") {
    return "ply\nformat ascii 1.0\nelement vertex " + vertices +
           "\nproperty float x\nproperty float y\nproperty float z\n" + more + "end_header\n" + rows;
}

std::string vtk_of(const std::string &sections) {
    return "# vtk DataFile Version 3.0\ntitle\nASCII\nDATASET POLYDATA\n" + sections;
}

std::string binary_vtk_of(const std::string &sections) {
    return "# vtk DataFile Version 3.0\ntitle\nBINARY\nDATASET POLYDATA\n" + sections;
}

// A file of each kind, and how many of its bytes the particles need.
struct Specimen {
    std::string content;
    size_t needed;
};

std::vector<Specimen> specimens() {
    std::vector<Specimen> result;
    for (const char *version : {"2.0", "5.1"})
        for (bool binary : {false, true}) {
            VtkStyle style;
            style.version = version;
            style.binary = style.metadata = binary;
            const std::string content = vtk(style);
            // In text the last coordinate is "-0", two line ends before CELLS.
            result.push_back({content, binary ? content.find("\nMETADATA") : content.find("CELLS") - 3});
        }
    result.push_back({bgeo_with_tail(), bgeo().size()});
    const std::string compressed = gzip(bgeo_with_tail());
    result.push_back({compressed, compressed.size()});
    for (PlyFormat format : {PlyFormat::ascii, PlyFormat::little, PlyFormat::big}) {
        const std::string content = ply(format);
        result.push_back({content, content.size() - (format == PlyFormat::ascii ? 2 : 0)});
    }
    return result;
}

void check_bytes(const std::string &content) {
    fuzz_particles(reinterpret_cast<const uint8_t *>(content.data()), content.size());
}

// --- files of others -----------------------------------------------------------------------------------------------

std::string real_file(const std::string &name) { return data_path("particles/" + name); }

using Point = std::array<double, 3>;

struct Known {
    const char *file;
    size_t count;
    Point least, greatest, first, middle, last;
};

// Read by an independent script.
const Known known_files[] = {
    {"splashsurf/ParticleData_Random_1000.vtk",
     1000,
     {7.369943341473117e-05, 0.00036734374589286745, 0.0005459649255499244},
     {0.9983548521995544, 0.9999639987945557, 0.9998085498809814},
     {0.54881352186203, 0.7151893377304077, 0.6027633547782898},
     {0.4467933177947998, 0.8369903564453125, 0.2218240350484848},
     {0.323613703250885, 0.8135449886322021, 0.6974003911018372}},
    {"splashsurf/bunny_frame_14_7705_particles.vtk",
     7706,
     {-0.60871422290802, 0.6701403260231018, -0.9785038828849792},
     {0.7241355180740356, 2.031560182571411, 0.679611325263977},
     {0.12854121625423431, 0.8383985757827759, 0.11624263226985931},
     {0.28231149911880493, 1.6828081607818604, -0.5053393840789795},
     {-0.19719751179218292, 1.998595952987671, -0.167732834815979}},
    {"splashsurf/double_dam_break_frame_01_4732_particles.vtk",
     4732,
     {-1.4500000476837158, 0.04999019205570221, -1.4500000476837158},
     {1.4500000476837158, 0.6999902129173279, 1.4500000476837158},
     {0.8500000238418579, 0.09999018907546997, 0.8500000238418579},
     {-1.4500000476837158, 0.14999020099639893, -1.4500000476837158},
     {-0.8500000238418579, 0.04999019205570221, -0.8500000238418579}},
    {"splashsurf/cube_8_particles.vtk",
     8,
     {0.5, 0.4995095, 0.5},
     {1, 0.9995095, 1},
     {0.5, 0.4995095, 0.5},
     {1, 0.4995095, 0.5},
     {1, 0.9995095, 1}},
    {"splashsurf/cube_normals.ply", 24, {-1, -1, -1}, {1, 1, 1}, {-1, 1, 1}, {1, 1, 1}, {1, 1, 1}},
    {"partio/base.bgeo",
     5,
     {0, 0.10000000149011612, 0.20000000298023224},
     {0.4000000059604645, 0.5, 0.6000000238418579},
     {0, 0.10000000149011612, 0.20000000298023224},
     {0.20000000298023224, 0.30000001192092896, 0.4000000059604645},
     {0.4000000059604645, 0.5, 0.6000000238418579}},
    {"splashsurf/dam_break_frame_9_6859_particles.bgeo",
     6859,
     {-1.9516323804855347, 0.03568214178085327, -0.7104318737983704},
     {-0.3876219689846039, 0.6816501021385193, 0.7108961343765259},
     {-1.910224199295044, 0.05864475294947624, 0.15789386630058289},
     {-1.7250324487686157, 0.05472668260335922, -0.26969480514526367},
     {-1.0363256931304932, 0.5212406516075134, 0.05060062184929848}},
    {"splashsurf/hilbert_46843_particles.bgeo",
     46843,
     {-1.1991385221481323, -1.197780728340149, 0.07326971739530563},
     {1.199764609336853, 1.1930689811706543, 2.471487283706665},
     {-0.869816780090332, -1.0195673704147339, 0.09513045102357864},
     {-0.3308930993080139, 0.19615477323532104, 1.25184965133667},
     {1.0618568658828735, 0.841092050075531, 2.44561505317688}},
    {"splishsplash/particle_grid.bgeo",
     400,
     {-7.150000095367432, 0.7250000238418579, -7.150000095367432},
     {7.099999904632568, 0.7250000238418579, 7.099999904632568},
     {-7.150000095367432, 0.7250000238418579, -7.150000095367432},
     {-7.150000095367432, 0.7250000238418579, 0.3499999940395355},
     {7.099999904632568, 0.7250000238418579, 7.099999904632568}},
    {"splishsplash/sphere.bgeo",
     12394,
     {-0.9983659982681274, -0.9985390305519104, -0.997565507888794},
     {0.9974814057350159, 0.999101996421814, 0.9975413084030151},
     {-0.9600089192390442, -0.26507288217544556, -0.0100906016305089},
     {-0.769635796546936, -0.5958541035652161, 0.20513157546520233},
     {-0.5035305619239807, -0.84560227394104, -0.155024453997612}},
};

} // namespace

// --- what is read --------------------------------------------------------------------------------------------------

TEST_CASE("particles: real files give the known counts, boxes and points") {
    WISP_NEEDS_DATA("particles");
    for (const Known &known : known_files) {
        CAPTURE(known.file);
        const std::string path = real_file(known.file);
        const Particles particles = read_particles(path);
        REQUIRE(particles.position.size() == known.count);
        Point least = particles.position[0], greatest = least;
        for (const Point &point : particles.position)
            for (size_t k = 0; k < 3; ++k) {
                least[k] = std::min(least[k], point[k]);
                greatest[k] = std::max(greatest[k], point[k]);
            }
        CHECK(least == known.least);
        CHECK(greatest == known.greatest);
        CHECK(particles.position.front() == known.first);
        CHECK(particles.position[known.count / 2] == known.middle);
        CHECK(particles.position.back() == known.last);
        CHECK(particles.mass.empty());
        CHECK(particles.smoothing_length.empty());
        CHECK(particles.has_particle_radius == (path.find("sphere") != std::string::npos));
        CHECK(particles.density.empty() == (path.find("dam_break_frame_9") == std::string::npos));
    }
}

TEST_CASE("particles: the density in a SPlisHSPlasH file is read") {
    WISP_NEEDS_DATA("particles");
    const Particles particles = read_particles(real_file("splashsurf/dam_break_frame_9_6859_particles.bgeo"));
    REQUIRE(particles.density.size() == 6859);
    double sum = 0;
    for (double density : particles.density) sum += density;
    CHECK(sum == 5937215.097564697);
    CHECK(particles.density.front() == 1000.1286010742188);
    CHECK(particles.density.back() == 654.8408203125);
}

TEST_CASE("particles: real files of other formats are refused by name") {
    WISP_NEEDS_DATA("particles");
    const std::string xml = real_file("splashsurf/fluid_250_particles.vtu");
    const std::string geo = real_file("partio/test.geo");
    CHECK_THROWS_WITH_AS(read_particles(xml),
                         (xml + ": byte 0: an XML file, expected legacy VTK: save as .vtk").c_str(), InputError);
    CHECK_THROWS_WITH_AS(read_particles(geo),
                         (geo + ": byte 0: a text geo, expected BGEO version 5: save as .bhclassic").c_str(),
                         InputError);
}

TEST_CASE("particles: every kind of legacy VTK gives the same table") {
    for (const char *version : {"1.0", "2.0", "3.0", "4.1", "5.1"})
        for (const char *dataset : {"POLYDATA", "UNSTRUCTURED_GRID"})
            for (const char *line_end : {"\n", "\r\n"})
                for (int flags = 0; flags < 64; ++flags) {
                    VtkStyle style;
                    style.version = version;
                    style.dataset = dataset;
                    style.line_end = line_end;
                    style.binary = flags & 1;
                    style.doubles = flags & 2;
                    style.metadata = flags & 4;
                    style.lookup_table = flags & 8;
                    style.cell_data = flags & 16;
                    style.surplus_arrays = flags & 32;
                    // Where arrays are missing, nothing may follow.
                    if (style.surplus_arrays && style.cell_data) continue;
                    CAPTURE(version);
                    CAPTURE(dataset);
                    CAPTURE(flags);
                    check_equal(parse(vtk(style)), sample());
                }
}

TEST_CASE("particles: VTK keywords may be small, and lie apart") {
    check_equal(parse("# vtk DataFile Version 2.0\n\nascii\n\n\ndataset polydata\n\npoints\t2\n\nFLOAT\n1 2\n3 4 5 6"),
                parse(vtk_of("POINTS 2 float\n1 2 3\n4 5 6\n")));
}

TEST_CASE("particles: 64-bit coordinates keep all bits, 32-bit text is rounded as 32-bit data") {
    const Particles doubles = parse(vtk_of("POINTS 1 double\n0.1 +2.5e-310 1e-400"));
    CHECK(doubles.position[0] == Point{0.1, 2.5e-310, 0});
    const Particles floats = parse(vtk_of("POINTS 1 float\n0.1 -1e-46 16777217"));
    CHECK(floats.position[0] == Point{0.1f, 0, 16777216});
    // Halfway between two floats but for the last digit: rounded once, not twice.
    CHECK(parse(vtk_of("POINTS 1 float\n1.000000059604644775390625000000001 0 0")).position[0][0] ==
          1.00000011920928955078125);
}

TEST_CASE("particles: packed 64-bit coordinates may begin with white space") {
    double first;
    const uint64_t bits = 0x0a200a0d20090a20;
    std::memcpy(&first, &bits, sizeof first);
    const std::string points = packed(first) + packed(first) + packed(first);
    CHECK(parse(binary_vtk_of("POINTS 1 double\n" + points)).position[0] == Point{first, first, first});
    const std::string ply_header = "ply\nformat binary_big_endian 1.0\nelement vertex 1\nproperty double x\nproperty "
                                   "double y\nproperty double z\nend_header\n";
    CHECK(parse(ply_header + points).position[0] == Point{first, first, first});
}

TEST_CASE("particles: BGEO with strings, vectors and integers, plain and compressed") {
    Particles expected = sample();
    expected.has_particle_radius = true;
    check_equal(parse(bgeo()), expected);
    check_equal(parse(bgeo_with_tail()), expected);
    check_equal(parse(gzip(bgeo_with_tail())), expected);
    check_equal(parse(gzip(bgeo_with_tail(), "particles.bgeo")), expected);
    const std::string whole = bgeo();
    check_equal(parse(gzip(whole.substr(0, 100)) + gzip(whole.substr(100))), expected);
}

TEST_CASE("particles: an integer attribute is read as a number") {
    const std::string text = bgeo_header(1, 1) + bgeo_attribute("mass", 1, 1) + packed(int32_t{0}) + packed(1.0f) +
                             packed(2.0f) + packed(3.0f) + packed(1.0f) + packed(int32_t{12});
    CHECK(parse(text).mass == std::vector<double>{12});
}

TEST_CASE("particles: attributes with more components are skipped") {
    const std::string text = bgeo_header(1, 2) + bgeo_attribute("mass", 2, 0) + packed(0.0f) + packed(0.0f) +
                             bgeo_attribute("density", 0, 0) + packed(1.0f) + packed(2.0f) + packed(3.0f) +
                             packed(1.0f) + packed(-1.0f) + packed(-2.0f);
    CHECK(parse(text).position[0] == Point{1, 2, 3});
    CHECK(parse(text).mass.empty());
    CHECK(parse(text).density.empty());
}

TEST_CASE("particles: VTK attributes of every type of number") {
    const auto density_of = [](const std::string &type, const std::string &bytes) {
        return parse(binary_vtk_of("POINTS 1 float\n" + std::string(12, '\0') + "\nPOINT_DATA 1\nSCALARS density " +
                                   type + "\n" + bytes))
            .density;
    };
    const std::string ff(1, '\xff'), tail(7, '\x0a');
    CHECK(density_of("char", ff) == std::vector<double>{-1});
    CHECK(density_of("unsigned_char", ff) == std::vector<double>{255});
    CHECK(density_of("short", ff + tail.substr(0, 1)) == std::vector<double>{-246});
    CHECK(density_of("unsigned_short", ff + tail.substr(0, 1)) == std::vector<double>{65290});
    CHECK(density_of("int", ff + ff + tail.substr(0, 2)) == std::vector<double>{-62966});
    CHECK(density_of("vtkIdType", ff + ff + tail.substr(0, 2)) == std::vector<double>{-62966});
    CHECK(density_of("unsigned_int", ff + ff + tail.substr(0, 2)) == std::vector<double>{4294904330});
    CHECK(density_of("long", packed(int64_t{-5})) == std::vector<double>{-5});
    CHECK(density_of("vtktypeint64", packed(int64_t{-5})) == std::vector<double>{-5});
    CHECK(density_of("unsigned_long", packed(uint64_t{1} << 63)) == std::vector<double>{9223372036854775808.0});
    CHECK(density_of("vtktypeuint64", packed(uint64_t{1} << 63)) == std::vector<double>{9223372036854775808.0});
}

TEST_CASE("particles: every encoding of PLY gives the same table") {
    for (PlyFormat format : {PlyFormat::ascii, PlyFormat::little, PlyFormat::big})
        for (const char *line_end : {"\n", "\r\n"}) {
            CAPTURE(static_cast<int>(format));
            check_equal(parse(ply(format, line_end)), sample());
        }
    check_equal(parse(gzip(ply(PlyFormat::little))), sample());
}

TEST_CASE("particles: integer coordinates and both names of h") {
    const std::string header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty char x\nproperty ushort "
        "y\nproperty int z\nproperty uint smoothing_length\nproperty float radius\nend_header\n";
    const Particles particles =
        parse(header + "\xff" + packed(uint16_t{65535}, false) + packed(int32_t{-70000}, false) +
              packed(uint32_t{4000000000}, false) + packed(1.0f, false));
    CHECK(particles.position[0] == Point{-1, 65535, -70000});
    CHECK(particles.smoothing_length == std::vector<double>{4e9});
    CHECK(particles.has_particle_radius);
}

TEST_CASE("particles: of a mesh it is known that it has faces") {
    const auto ply_with = [](const std::string &faces) {
        return "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nelement "
               "face " +
               faces + "\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n3 0 0 0\n";
    };
    CHECK(parse(ply_with("1")).has_faces);
    CHECK(!parse(ply_with("0")).has_faces);
    CHECK(!parse(ply_of("1 2 3")).has_faces);
    const std::string point = "POINTS 1 float\n1 2 3\n";
    CHECK(parse(vtk_of(point + "POLYGONS 1 4\n3 0 0 0\n")).has_faces);
    CHECK(parse(vtk_of(point + "TRIANGLE_STRIPS 1 4\n3 0 0 0\n")).has_faces);
    CHECK(!parse(vtk_of(point + "POLYGONS 0 0\n")).has_faces);
    CHECK(!parse(vtk_of(point + "VERTICES 1 2\n1 0\n")).has_faces);
}

TEST_CASE("particles: a text may end with its last digit") {
    CHECK(parse(ply_of("1 2 3")).position[0] == Point{1, 2, 3});
    CHECK(parse(vtk_of("POINTS 1 float\n1 2 3\nPOINT_DATA 1\nSCALARS mass float\n4")).mass == std::vector<double>{4});
}

TEST_CASE("particles: no particles are a file, too") {
    CHECK(parse(vtk_of("POINTS 0 float\n")).position.empty());
    CHECK(parse(binary_vtk_of("POINTS 0 float\nCELLS 0 0\n\nPOINT_DATA 0\nSCALARS mass float\n\n")).position.empty());
    CHECK(parse(bgeo_header(0, 0)).position.empty());
    CHECK(parse(ply_of("", "0")).position.empty());
}

// --- what is refused -----------------------------------------------------------------------------------------------

TEST_CASE("particles: files that are none of the formats") {
    const std::string unknown = "file: byte 0: not a particle file, expected legacy VTK, BGEO version 5 or PLY";
    CHECK(error_of("") == unknown);
    CHECK(error_of("solid cube") == unknown);
    CHECK(error_of("\x7fNSJ...") == "file: byte 0: a new JSON bgeo, expected BGEO version 5: save as .bhclassic");
    CHECK_THROWS_WITH_AS(parse_particles("a.VTK", nullptr, 0),
                         "a.VTK: byte 0: not a legacy VTK file, expected '# vtk DataFile Version' at its start",
                         InputError);
    CHECK_THROWS_WITH_AS(parse_particles("a.ply", nullptr, 0),
                         "a.ply: byte 0: not a PLY file, expected 'ply' at its start", InputError);
    CHECK_THROWS_WITH_AS(read_particles("no/such/file.vtk"),
                         "no/such/file.vtk: cannot be opened: No such file or directory", InputError);
}

TEST_CASE("particles: VTK errors name the line, or the byte of packed data") {
    CHECK(error_of("# vtk DataFile Version 6.0\n") == "file:1: version '6.0', expected 1.0 to 5.1");
    CHECK(error_of("# vtk DataFile Version 3.0\nt\nTEXT\n") == "file:3: 'TEXT', expected ASCII or BINARY");
    for (const char *grid : {"STRUCTURED_POINTS", "STRUCTURED_GRID", "RECTILINEAR_GRID"})
        CHECK(error_of("# vtk DataFile Version 3.0\nt\nASCII\nDATASET " + std::string(grid) + "\n") ==
              "file:4: DATASET '" + std::string(grid) +
                  "' does not hold particles, expected UNSTRUCTURED_GRID or POLYDATA");
    CHECK(error_of("# vtk DataFile Version 3.0\nt\nBINARY\nDATASET STRUCTURED_POINTS\n") ==
          "file: byte 44: DATASET 'STRUCTURED_POINTS' does not hold particles, expected UNSTRUCTURED_GRID or POLYDATA");
    CHECK(error_of(vtk_of("")) == "file:4: no POINTS, expected them after DATASET");
    CHECK(error_of(vtk_of("POINTS -1 float\n")) == "file:5: '-1', expected the number of points");
    CHECK(error_of(vtk_of("POINTS 2 real\n")) == "file:5: type 'real', expected float, double or an integer type");
    CHECK(error_of(vtk_of("POINTS 2 float\n1 2 3\n4 x 6\n")) == "file:7: 'x', expected a number");
    CHECK(error_of(vtk_of("POINTS 2 float\n1 2 3\n4  5   \n")) == "file:8: the file ends, expected a number");
    CHECK(error_of(vtk_of("POINTS 2 float\n1 2 3\n4 nan 6\n")) ==
          "file:7: y of point 1 is nan, expected a finite number");
    CHECK(error_of(vtk_of("POINTS 1 float\n1 2 -1e39\n")) == "file:6: z of point 0 is -inf, expected a finite number");
    CHECK(error_of(vtk_of("POINTS 1 float\n1 2 3\nPOINTS 1 float\n1 2 3\n")) ==
          "file:7: POINTS again, expected them only once");
    CHECK(error_of(vtk_of("POINTS 9 float\n1 2 3\n")) ==
          "file:5: 9 points, expected at most 1: the file ends 7 bytes further on");
    CHECK(error_of(vtk_of("SCALARS mass float\n1 2 3\n")) ==
          "file:5: 'SCALARS', expected a keyword such as POINTS, CELLS or POINT_DATA");
    CHECK(error_of(vtk_of("POINT_DATA 0\n")) == "file:5: POINT_DATA before POINTS, expected it after them");
    const std::string one = vtk_of("POINTS 1 float\n1 2 3\nPOINT_DATA 1\n");
    CHECK(error_of(one + "SCALARS mass float\nLOOKUP_TABLE t\n-1\n") ==
          "file:10: mass of point 0 is -1, expected 0 or more");
    CHECK(error_of(one + "SCALARS h float\n0\n") == "file:9: smoothing length of point 0 is 0, expected more than 0");
    CHECK(error_of(one + "SCALARS h float\n1\nFIELD f 1\nsmoothing_length 1 1 float\n1\n") ==
          "file:11: smoothing length again, expected it only once");
    CHECK(error_of(one + "FIELD f 1\nmass 1 2 float\n1 2\n") == "file:9: 2 tuples, expected 1 as in POINTS");
    CHECK(error_of(one + "FIELD f 1\nkind 1 1 string\nsmoke\n") ==
          "file:9: type 'string', expected float, double or an integer type");
    CHECK(error_of(vtk_of("POINTS 1 float\n1 2 3\nPOINT_DATA 2\n")) == "file:7: POINT_DATA 2, expected 1 as in POINTS");
    const float nan = std::numeric_limits<float>::quiet_NaN();
    CHECK(error_of(binary_vtk_of("POINTS 1 float\n" + packed(1.0f) + packed(nan) + packed(1.0f))) ==
          "file: byte 76: y of point 0 is nan, expected a finite number");
    CHECK(error_of(binary_vtk_of("POINTS 1 float 7\n" + std::string(12, '\0'))) ==
          "file: byte 72: '7', expected the end of the line");
}

TEST_CASE("particles: BGEO errors name the byte") {
    CHECK(error_of("BgeoX") == "file: byte 4: no 'V' after 'Bgeo', expected BGEO version 5");
    CHECK(error_of(bgeo_header(0, 0, 6)) == "file: byte 5: BGEO version 6, expected 5");
    CHECK(error_of(bgeo_header(-1, 0)) == "file: byte 9: -1 points, expected 0 or more");
    CHECK(error_of(bgeo_header(0, -1)) == "file: byte 25: -1 point attributes, expected 0 or more");
    CHECK(error_of(bgeo_header(3, 0) + std::string(47, '\0')) ==
          "file: byte 37: 3 points, expected at most 2: the file ends 47 bytes further on");
    CHECK(error_of(bgeo_header(1, 1) + bgeo_attribute("name", 1, 2)) ==
          "file: byte 49: attribute 'name' has type 2, expected 0 (float), 1 (int), 4 (indexed string) or 5 (vector)");
    CHECK(error_of(bgeo_header(1, 1)) == "file: byte 41: the file ends, expected a number of 2 bytes");
    CHECK(error_of(bgeo_header(1, 1) + bgeo_attribute("v", 3, 5)) == "file: byte 50: the file ends, expected 12 bytes");
    const float infinity = std::numeric_limits<float>::infinity();
    CHECK(error_of(bgeo_header(1, 0) + packed(infinity) + std::string(12, '\0')) ==
          "file: byte 41: x of point 0 is inf, expected a finite number");
}

TEST_CASE("particles: PLY errors name the line, or the byte of packed data") {
    const std::string start = "ply\nformat ascii 1.0\n";
    CHECK(error_of("plywood\n") == "file:1: 'plywood', expected 'ply'");
    CHECK(error_of("ply\nformat ascii 2.0\n") == "file:2: version '2.0', expected 1.0");
    CHECK(error_of("ply\nformat utf8 1.0\n") ==
          "file:2: format 'utf8', expected ascii, binary_little_endian or binary_big_endian");
    CHECK(error_of(start + "element vertex four\n") == "file:3: 'four', expected the number of rows");
    CHECK(error_of(start + "property float x\n") ==
          "file:3: a property without an element, expected 'element' before it");
    CHECK(error_of(start + "element vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n") ==
          "file:6: no property z, expected x, y and z in element vertex");
    CHECK(error_of(start + "element vertex 1\nproperty list uchar float x\n") ==
          "file:4: property x is a list, expected a number");
    CHECK(error_of(start + "element vertex 1\nproperty float x\nproperty float x\n") ==
          "file:5: x again, expected it only once");
    CHECK(error_of(start + "element vertex 1\nproperty half x\n") ==
          "file:4: type 'half', expected char, uchar, short, ushort, int, uint, float or double");
    CHECK(error_of(start + "element vertex 1\nelement vertex 1\n") ==
          "file:4: element 'vertex' again, expected it only once");
    CHECK(error_of(start + "element vertex 1\nproperty list float int q\n") ==
          "file:4: a list's length of a floating-point type, expected an integer type");
    CHECK(error_of(start + "face 7\n") == "file:3: 'face', expected format, element, property, comment or end_header");
    CHECK(error_of("ply\nelement vertex 0\nproperty int x\nproperty int y\nproperty int z\nend_header\n") ==
          "file:6: no 'format' in the header, expected it after 'ply'");
    CHECK(error_of(ply_of("1 2\n3\n")) == "file:8: the line ends, expected another number");
    CHECK(error_of(ply_of("1 2 3 4\n")) == "file:8: '4', expected the end of the line");
    CHECK(error_of(ply_of("1 2 3\n4 inf 6\n", "2")) == "file:9: y of point 1 is inf, expected a finite number");
    CHECK(error_of(ply_of("1 2 3\n", "4000000000")) ==
          "file:7: 4000000000 rows, expected at most 1: the file ends 6 bytes further on");
    CHECK(error_of(ply_of("1 2 3 1e300\n", "1", "property list int int q\n")) ==
          "file:9: not a list's length, expected a whole number");
    CHECK(error_of(ply_of("1 2 3 -1\n", "1", "property float mass\n")) ==
          "file:9: mass of point 0 is -1, expected 0 or more");
    const std::string packed_header =
        "ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty "
        "float y\nproperty float z\nproperty list char int q\nend_header\n";
    CHECK(error_of(packed_header + std::string(12, '\0') + "\xff") ==
          "file: byte " + std::to_string(packed_header.size() + 12) + ": not a list's length, expected a whole number");
}

TEST_CASE("particles: the wrong byte order is refused where it makes no sense") {
    std::string swapped = "BgeoV" + packed(int32_t{5}, false);
    CHECK(error_of(swapped) == "file: byte 5: BGEO version 83886080, expected 5");
}

TEST_CASE("particles: counts beyond the file are refused before memory is taken") {
    const std::string huge = "9000000000000000000";
    for (const std::string &mode : {vtk_of(""), binary_vtk_of("")})
        for (const std::string &sections :
             {"POINTS " + huge + " float\n", "CELLS 1 " + huge + "\n", "CELL_TYPES " + huge + "\n",
              "FIELD f " + huge + "\na " + huge + " " + huge + " float\n", "CELL_DATA " + huge + "\nSCALARS a float\n",
              "CELL_DATA " + huge + "\nTENSORS a double\n", "CELL_DATA 2\nCOLOR_SCALARS a " + huge + "\n",
              "CELL_DATA 2\nTEXTURE_COORDINATES a " + huge + " int\n", "CELL_DATA 2\nLOOKUP_TABLE a " + huge + "\n"}) {
            CAPTURE(sections);
            CHECK(error_of(mode + sections + std::string(100, ' ')).find(", expected at most ") != std::string::npos);
        }
    CHECK(error_of(bgeo_header(0x7fffffff, 0)).find("2147483647 points") != std::string::npos);
    CHECK(error_of(bgeo_header(0, 0x7fffffff)).find("the file ends") != std::string::npos);
    CHECK(error_of(bgeo_header(0, 1) + bgeo_attribute("s", 1, 4) + packed(int32_t{0x7fffffff})).find("the file ends") !=
          std::string::npos);
    CHECK(error_of(ply_of("1 2 3\n", huge)).find(huge) != std::string::npos);
    CHECK(error_of("ply\nformat ascii 1.0\nelement face " + huge +
                   "\nproperty list int int i\nelement vertex 1\nproperty "
                   "int x\nproperty int y\nproperty int z\nend_header\n1 1\n") != "no error");
}

TEST_CASE("particles: damaged gzip is refused, and a bomb takes no memory") {
    const std::string whole = gzip(bgeo());
    std::string wrong_crc = whole, wrong_size = whole, wrong_data = whole;
    wrong_crc[whole.size() - 8] ^= 1;
    wrong_size[whole.size() - 4] ^= 1;
    wrong_data[whole.size() / 2] ^= 0x10;
    const std::string wants = "), expected data as gzip writes it";
    for (const std::string &damaged : {wrong_crc, wrong_size, wrong_data, whole + "more"}) {
        const std::string error = error_of(damaged);
        CHECK(error.find(": damaged gzip data (") != std::string::npos);
        CHECK(error.substr(error.size() - wants.size()) == wants);
    }
    CHECK(error_of(whole.substr(0, whole.size() - 1)) ==
          "file: byte " + std::to_string(whole.size() - 1) + ": the gzip data ends early, expected more of it");
    const std::string bomb = gzip(std::string(8 << 20, 'x'));
    REQUIRE(bomb.size() < 10000);
    const size_t most = gzip_allowance + gzip_largest_ratio * bomb.size();
    CHECK(error_of(bomb).find("inflates to more than " + std::to_string(most) + " bytes, expected at most 256 times") !=
          std::string::npos);
}

TEST_CASE("particles: every truncation is an error or a table, and an error where particles are missing") {
    for (const Specimen &specimen : specimens())
        for (size_t size = 0; size < specimen.content.size(); ++size) {
            const std::string start = specimen.content.substr(0, size);
            check_bytes(start);
            if (size >= specimen.needed) continue;
            CAPTURE(specimen.content.substr(0, 40));
            CAPTURE(size);
            CHECK(error_of(start) != "no error");
        }
}

TEST_CASE("particles: random changes of bytes are an error or a table") {
    uint64_t state = 1;
    const auto random = [&state](size_t below) {
        state = state * 6364136223846793005u + 1442695040888963407u;
        return static_cast<size_t>((state >> 33) % below);
    };
    const char likely[] = {'\0', '\n', ' ', '-', '9', '\x7f', '\x80', '\xff'};
    for (const Specimen &specimen : specimens())
        for (int round = 0; round < 4000; ++round) {
            std::string changed = specimen.content;
            for (size_t changes = 1 + random(4); changes > 0; --changes) {
                char &byte = changed[random(changed.size())];
                byte = random(2) ? likely[random(sizeof likely)] : static_cast<char>(random(256));
            }
            check_bytes(changed);
        }
}
