// BGEO version 5, "classic", as Houdini (.bhclassic), Partio and SPlisHSPlasH write it. All numbers are big-endian.
//
//     "Bgeo" 'V'  i32 version
//     i32 points, primitives, point groups, primitive groups, point attributes, vertex, primitive, detail attributes
//     per point attribute  u16 length, name, u16 components, i32 type, then the default or the strings' table
//     per point            x y z w and the components of each attribute, 32 bits each
//
// What follows the points (primitives, detail attributes) is not read.
#include "host/formats/particle_readers.h"

namespace wisp {
namespace {

constexpr uint64_t word_size = 4;

struct Attribute {
    Column column;
    Scalar type;
    uint64_t components;
};

class BgeoReader {
  public:
    explicit BgeoReader(ByteReader &reader) : in_(reader), table_(reader) {}

    Particles read() {
        in_.bytes(4); // the magic word
        if (in_.bytes(1) != "V") in_.fail("no 'V' after 'Bgeo', expected BGEO version 5");
        const int64_t version = integer(Scalar::i32);
        if (version != 5) in_.fail("BGEO version " + std::to_string(version) + ", expected 5");
        const uint64_t point_count = count("points");
        for (const char *items : {"primitives", "point groups", "primitive groups"}) count(items);
        const uint64_t attribute_count = count("point attributes");
        for (const char *items : {"vertex attributes", "primitive attributes", "detail attributes"}) count(items);

        for (Column column : {Column::x, Column::y, Column::z}) table_.claim(column);
        std::vector<Attribute> attributes;
        uint64_t words = 4;
        for (uint64_t i = 0; i < attribute_count; ++i) {
            attributes.push_back(definition());
            words += attributes.back().components;
        }

        in_.require(point_count, words * word_size, "points");
        table_.set_count(point_count);
        for (uint64_t i = 0; i < point_count; ++i) read_point(i, attributes);
        return table_.take();
    }

  private:
    int64_t integer(Scalar type) { return static_cast<int64_t>(in_.number(type)); }

    uint64_t count(const char *items) {
        const int64_t number = integer(Scalar::i32);
        if (number < 0) in_.fail(std::to_string(number) + " " + items + ", expected 0 or more");
        return static_cast<uint64_t>(number);
    }

    std::string_view string() { return in_.bytes(static_cast<uint64_t>(integer(Scalar::u16))); }

    Attribute definition() {
        const std::string_view name = string();
        const auto components = static_cast<uint64_t>(integer(Scalar::u16));
        enum Type { type_float = 0, type_int = 1, type_indexed_string = 4, type_vector = 5 };
        const int64_t type = integer(Scalar::i32);
        switch (type) {
        case type_float:
        case type_int:
        case type_vector:
            in_.bytes(components * word_size); // the default value
            break;
        case type_indexed_string: {
            const uint64_t strings = count("strings");
            for (uint64_t i = 0; i < strings; ++i) string();
            return {Column::unused, Scalar::u32, components};
        }
        default:
            in_.fail("attribute " + ByteReader::quoted(name) + " has type " + std::to_string(type) +
                     ", expected 0 (float), 1 (int), 4 (indexed string) or 5 (vector)");
        }
        return {components == 1 ? table_.claim(name) : Column::unused, type == type_int ? Scalar::i32 : Scalar::f32,
                components};
    }

    void read_point(uint64_t point, const std::vector<Attribute> &attributes) {
        for (Column column : {Column::x, Column::y, Column::z}) table_.store(column, point, in_.number(Scalar::f32));
        in_.bytes(word_size); // w, which is 1
        for (const Attribute &attribute : attributes)
            if (attribute.column == Column::unused)
                in_.bytes(attribute.components * word_size);
            else
                table_.store(attribute.column, point, in_.number(attribute.type));
    }

    ByteReader &in_;
    ParticleBuilder table_;
};

} // namespace

Particles parse_bgeo(ByteReader &reader) { return BgeoReader(reader).read(); }

} // namespace wisp
