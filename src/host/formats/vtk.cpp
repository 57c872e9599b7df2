// Legacy VTK, versions 1.0 to 5.1 (docs.vtk.org, "VTK legacy file format"): the points are the particles, and scalar
// arrays of POINT_DATA their attributes.
//
// A file is a sequence of sections. Each begins with a keyword line, which is text in both modes, and most go on with
// arrays. In BINARY mode an array is packed, big-endian, and begins right after the end of that line. So white space
// is skipped before keywords only, never before an array: its first byte may look like a blank.
#include "host/formats/particle_readers.h"

namespace wisp {
namespace {

class VtkReader {
  public:
    explicit VtkReader(ByteReader &reader) : in_(reader), table_(reader) {}

    Particles read() {
        read_header();
        while (in_.find_word()) read_section(in_.word("a keyword"));
        if (!has_points_) in_.fail("no POINTS, expected them after DATASET");
        return table_.take();
    }

  private:
    // What the arrays at this place belong to.
    enum class Owner { dataset, points, cells };

    void read_header() {
        in_.bytes(std::strlen("# vtk DataFile Version"));
        const std::string_view version = in_.word_in_line("a version");
        if (version.size() < 2 || version[0] < '1' || version[0] > '5' || version[1] != '.')
            in_.fail("version " + ByteReader::quoted(version) + ", expected 1.0 to 5.1");
        major_version_ = version[0] - '0';
        in_.line();
        in_.line(); // the title
        const std::string_view mode = in_.word("ASCII or BINARY");
        const std::string small = lower_case(mode);
        if (small != "ascii" && small != "binary") in_.fail(ByteReader::quoted(mode) + ", expected ASCII or BINARY");
        if (small == "binary") in_.set_encoding(Encoding::big_endian);

        const std::string_view keyword = in_.word("DATASET");
        if (lower_case(keyword) != "dataset") in_.fail(ByteReader::quoted(keyword) + ", expected DATASET");
        const std::string_view dataset = in_.word("UNSTRUCTURED_GRID or POLYDATA");
        const std::string kind = lower_case(dataset);
        if (kind != "unstructured_grid" && kind != "polydata")
            in_.fail("DATASET " + ByteReader::quoted(dataset) +
                     " does not hold particles, expected UNSTRUCTURED_GRID or POLYDATA");
    }

    void read_section(std::string_view word) {
        const std::string keyword = lower_case(word);
        if (keyword == "points") return read_points();
        if (keyword == "point_data" || keyword == "cell_data") return read_owner(keyword == "point_data");
        if (keyword == "field") return read_field();
        if (keyword == "metadata") return skip_metadata();
        if (keyword == "cell_types") return skip_array(1, in_.count("the number of cells"), Scalar::i32);
        for (const char *topology : {"cells", "vertices", "lines", "polygons", "triangle_strips"})
            if (keyword == topology) {
                const bool are_faces = keyword == "polygons" || keyword == "triangle_strips";
                if (skip_topology() > 0 && are_faces) table_.set_has_faces();
                return;
            }
        if (owner_ != Owner::dataset && keyword == "scalars") return read_scalars();
        if (owner_ == Owner::dataset || !skip_attribute(keyword))
            in_.fail(ByteReader::quoted(word) + ", expected a keyword such as POINTS, CELLS or POINT_DATA");
    }

    // POINTS n type
    void read_points() {
        if (has_points_) in_.fail("POINTS again, expected them only once");
        has_points_ = true;
        for (Column column : {Column::x, Column::y, Column::z}) table_.claim(column);
        point_count_ = in_.count("the number of points");
        const Scalar type = read_type();
        in_.require(point_count_, 3 * in_.least_size(type), "points");
        begin_array();
        table_.set_count(point_count_);
        for (uint64_t i = 0; i < point_count_; ++i)
            for (Column column : {Column::x, Column::y, Column::z}) table_.store(column, i, in_.number(type));
    }

    // POINT_DATA n, CELL_DATA n
    void read_owner(bool points) {
        tuples_ = in_.count("the number of points or cells");
        if (points && !has_points_) in_.fail("POINT_DATA before POINTS, expected it after them");
        if (points && tuples_ != point_count_)
            in_.fail("POINT_DATA " + std::to_string(tuples_) + ", expected " + std::to_string(point_count_) +
                     " as in POINTS");
        owner_ = points ? Owner::points : Owner::cells;
    }

    // FIELD name k, then k times: name components tuples type
    void read_field() {
        in_.word("the field's name");
        uint64_t arrays = in_.count("the number of arrays");
        // Writers count arrays that they then leave out, so the end of the file ends the field, too.
        while (arrays > 0 && in_.find_word()) {
            const std::string_view name = in_.word("the array's name");
            if (lower_case(name) == "metadata") {
                skip_metadata();
                continue;
            }
            --arrays;
            const uint64_t components = in_.count("the number of components");
            const uint64_t tuples = in_.count("the number of tuples");
            const Scalar type = read_type();
            begin_array();
            read_values(name, components, tuples, type);
        }
    }

    // SCALARS name type [components], then perhaps LOOKUP_TABLE name
    void read_scalars() {
        const std::string_view name = in_.word("the array's name");
        const Scalar type = read_type();
        const uint64_t components = in_.find_word_in_line() ? in_.count("the number of components") : 1;
        in_.end_line();
        if (in_.is_text()) in_.find_word();
        if (next_is("lookup_table")) in_.line();
        read_values(name, components, tuples_, type);
    }

    // The other sections of POINT_DATA and CELL_DATA, one array each; false if `keyword` is none of them.
    bool skip_attribute(const std::string &keyword) {
        if (keyword == "color_scalars" || keyword == "lookup_table") { // name n
            in_.word("a name");
            const uint64_t number = in_.count("a number of values");
            if (keyword == "color_scalars")
                skip_array(number, tuples_, Scalar::u8);
            else
                skip_array(4, number, Scalar::u8);
            return true;
        }
        struct TypedSection {
            std::string_view keyword;
            uint64_t components; // 0: given before the type
        };
        static constexpr TypedSection sections[] = {
            {"vectors", 3},    {"normals", 3},      {"tensors", 9},    {"tensors6", 6},
            {"global_ids", 1}, {"pedigree_ids", 1}, {"edge_flags", 1}, {"texture_coordinates", 0}};
        for (const TypedSection &section : sections) {
            if (keyword != section.keyword) continue;
            in_.word("the array's name");
            const uint64_t components = section.components ? section.components : in_.count("the number of components");
            skip_array(components, tuples_, read_type());
            return true;
        }
        return false;
    }

    // CELLS n size and then size integers; from version 5.0 on, CELLS a b and then perhaps two blocks with own types.
    // Returns the size, b.
    uint64_t skip_topology() {
        const uint64_t first = in_.count("a number of cells or offsets");
        const uint64_t second = in_.count("a number of integers");
        if (major_version_ < 5) {
            skip_array(1, second, Scalar::i32);
        } else {
            in_.end_line();
            skip_block("offsets", first);
            skip_block("connectivity", second);
        }
        return second;
    }

    void skip_block(std::string_view keyword, uint64_t count) {
        in_.find_word();
        if (!next_is(keyword)) return;
        in_.word("the keyword");
        skip_array(1, count, read_type());
    }

    // Up to an empty line.
    void skip_metadata() {
        in_.line();
        while (in_.left() && in_.line().find_first_not_of(" \t") != std::string_view::npos) continue;
    }

    // The array of an attribute, at its first byte.
    void read_values(std::string_view name, uint64_t components, uint64_t tuples, Scalar type) {
        require_array(components, tuples, type);
        const Column column = owner_ == Owner::points && components == 1 ? table_.claim(name) : Column::unused;
        if (column == Column::unused) return in_.skip_numbers(components * tuples, type);
        if (tuples != point_count_)
            in_.fail(std::to_string(tuples) + " tuples, expected " + std::to_string(point_count_) + " as in POINTS");
        table_.set_count(point_count_);
        for (uint64_t i = 0; i < tuples; ++i) table_.store(column, i, in_.number(type));
    }

    // An array whose keyword line is not yet over.
    void skip_array(uint64_t components, uint64_t tuples, Scalar type) {
        require_array(components, tuples, type);
        begin_array();
        in_.skip_numbers(components * tuples, type);
    }

    // After this, components * tuples does not overflow.
    void require_array(uint64_t components, uint64_t tuples, Scalar type) const {
        const uint64_t too_many = in_.left() + 2; // components for even one tuple; the exact number is then no matter
        in_.require(tuples, std::min(components, too_many) * in_.least_size(type), "tuples");
    }

    void begin_array() {
        if (!in_.is_text()) in_.end_line();
    }

    bool next_is(std::string_view keyword) const { return lower_case(in_.peek(keyword.size())) == keyword; }

    Scalar read_type() {
        struct Name {
            std::string_view name;
            Scalar type;
        };
        static constexpr Name names[] = {
            {"float", Scalar::f32},          {"double", Scalar::f64},        {"char", Scalar::i8},
            {"signed_char", Scalar::i8},     {"unsigned_char", Scalar::u8},  {"short", Scalar::i16},
            {"unsigned_short", Scalar::u16}, {"int", Scalar::i32},           {"unsigned_int", Scalar::u32},
            {"vtkidtype", Scalar::i32}, // written as int
            {"long", Scalar::i64},           {"unsigned_long", Scalar::u64}, {"vtktypeint64", Scalar::i64},
            {"vtktypeuint64", Scalar::u64},
        };
        const std::string_view word = in_.word("a type");
        const std::string type = lower_case(word);
        for (const Name &name : names)
            if (type == name.name) return name.type;
        in_.fail("type " + ByteReader::quoted(word) + ", expected float, double or an integer type");
    }

    ByteReader &in_;
    ParticleBuilder table_;
    int major_version_ = 0;
    bool has_points_ = false;
    uint64_t point_count_ = 0;
    Owner owner_ = Owner::dataset;
    uint64_t tuples_ = 0; // of each array of POINT_DATA or CELL_DATA
};

} // namespace

Particles parse_vtk(ByteReader &reader) { return VtkReader(reader).read(); }

} // namespace wisp
