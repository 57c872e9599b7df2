// PLY (Greg Turk, "The PLY Polygon File Format"): the vertices are the particles. A text header defines elements, each
// a table of rows; the rows of all elements follow in that order, as text (one row a line) or packed. Nothing is read
// after the vertices.
#include "host/formats/particle_readers.h"

namespace wisp {
namespace {

struct Property {
    Scalar type;
    bool is_list;
    Scalar count_type; // of a list: its length stands in front
    Column column;
};

struct Element {
    std::string name;
    uint64_t rows;
    std::vector<Property> properties;
};

class PlyReader {
  public:
    explicit PlyReader(ByteReader &reader) : in_(reader), table_(reader) {}

    Particles read() {
        read_header();
        for (const Element &element : elements_) {
            read_rows(element);
            if (element.name == "vertex") break;
        }
        return table_.take();
    }

  private:
    void read_header() {
        const std::string_view magic = in_.word("'ply'");
        if (magic != "ply") in_.fail(ByteReader::quoted(magic) + ", expected 'ply'");
        in_.end_line();
        Encoding encoding = Encoding::text;
        bool has_format = false;
        for (;;) {
            const std::string_view keyword = in_.word("end_header");
            if (keyword == "end_header") break;
            if (keyword == "comment" || keyword == "obj_info") {
                in_.line();
                continue;
            }
            if (keyword == "format") {
                if (has_format) in_.fail("'format' again, expected it only once");
                encoding = read_format();
                has_format = true;
            } else if (keyword == "element")
                read_element();
            else if (keyword == "property")
                read_property();
            else
                in_.fail(ByteReader::quoted(keyword) + ", expected format, element, property, comment or end_header");
            in_.end_line();
        }
        if (!has_format) in_.fail("no 'format' in the header, expected it after 'ply'");
        for (Column column : {Column::x, Column::y, Column::z})
            if (!table_.is_claimed(column))
                in_.fail(std::string("no property ") + "xyz"[static_cast<size_t>(column)] +
                         ", expected x, y and z in element vertex");
        in_.end_line();
        in_.set_encoding(encoding);
    }

    Encoding read_format() {
        const std::string_view name = in_.word_in_line("a format");
        Encoding encoding = Encoding::text;
        if (name == "binary_little_endian")
            encoding = Encoding::little_endian;
        else if (name == "binary_big_endian")
            encoding = Encoding::big_endian;
        else if (name != "ascii")
            in_.fail("format " + ByteReader::quoted(name) +
                     ", expected ascii, binary_little_endian or binary_big_endian");
        const std::string_view version = in_.word_in_line("version 1.0");
        if (version != "1.0") in_.fail("version " + ByteReader::quoted(version) + ", expected 1.0");
        return encoding;
    }

    void read_element() {
        const std::string name(in_.word_in_line("the element's name"));
        if (name == "vertex") {
            if (has_vertex_) in_.fail("element 'vertex' again, expected it only once");
            has_vertex_ = true;
        }
        elements_.push_back({name, in_.count("the number of rows"), {}});
        if (name == "face" && elements_.back().rows > 0) table_.set_has_faces();
    }

    Scalar to_type(std::string_view word) const {
        struct Name {
            std::string_view name, sized_name;
            Scalar type;
        };
        static constexpr Name names[] = {
            {"char", "int8", Scalar::i8},      {"uchar", "uint8", Scalar::u8},     {"short", "int16", Scalar::i16},
            {"ushort", "uint16", Scalar::u16}, {"int", "int32", Scalar::i32},      {"uint", "uint32", Scalar::u32},
            {"float", "float32", Scalar::f32}, {"double", "float64", Scalar::f64},
        };
        for (const Name &name : names)
            if (word == name.name || word == name.sized_name) return name.type;
        in_.fail("type " + ByteReader::quoted(word) +
                 ", expected char, uchar, short, ushort, int, uint, float or double");
    }

    void read_property() {
        if (elements_.empty()) in_.fail("a property without an element, expected 'element' before it");
        Property property{Scalar::f32, false, Scalar::u8, Column::unused};
        std::string_view type = in_.word_in_line("a type or 'list'");
        if (type == "list") {
            property.is_list = true;
            property.count_type = to_type(in_.word_in_line("the type of the list's length"));
            if (property.count_type == Scalar::f32 || property.count_type == Scalar::f64)
                in_.fail("a list's length of a floating-point type, expected an integer type");
            type = in_.word_in_line("the type of the list's items");
        }
        property.type = to_type(type);
        const std::string_view name = in_.word_in_line("the property's name");
        if (elements_.back().name == "vertex") property.column = claim(name, property.is_list);
        elements_.back().properties.push_back(property);
    }

    Column claim(std::string_view name, bool is_list) {
        const std::string small = lower_case(name);
        const bool is_coordinate = small == "x" || small == "y" || small == "z";
        if (is_coordinate && is_list) in_.fail("property " + small + " is a list, expected a number");
        if (is_coordinate) return table_.claim(static_cast<Column>(small[0] - 'x'));
        return is_list ? Column::unused : table_.claim(name);
    }

    void read_rows(const Element &element) {
        if (element.properties.empty()) return;
        uint64_t row_size = 0;
        for (const Property &property : element.properties)
            row_size += in_.least_size(property.is_list ? property.count_type : property.type);
        in_.require(element.rows, row_size, "rows");
        if (element.name == "vertex") table_.set_count(element.rows);
        for (uint64_t row = 0; row < element.rows; ++row) read_row(element, row);
    }

    void read_row(const Element &element, uint64_t row) {
        if (in_.is_text()) in_.find_word(); // over the end of the row before and empty lines
        for (const Property &property : element.properties) {
            uint64_t count = 1;
            if (property.is_list) count = list_length(property.count_type);
            if (property.column != Column::unused)
                table_.store(property.column, row, in_.number_in_line(property.type));
            else
                skip(count, property.type);
        }
        if (in_.is_text()) in_.end_line();
    }

    uint64_t list_length(Scalar type) {
        const double length = in_.number_in_line(type);
        if (!(length >= 0 && length <= 4294967295.0 && length == static_cast<double>(static_cast<uint64_t>(length))))
            in_.fail("not a list's length, expected a whole number");
        return static_cast<uint64_t>(length);
    }

    void skip(uint64_t count, Scalar type) {
        if (!in_.is_text())
            in_.skip_numbers(count, type);
        else
            for (uint64_t i = 0; i < count; ++i) in_.number_in_line(type);
    }

    ByteReader &in_;
    ParticleBuilder table_;
    std::vector<Element> elements_;
    bool has_vertex_ = false;
};

} // namespace

Particles parse_ply(ByteReader &reader) { return PlyReader(reader).read(); }

} // namespace wisp
