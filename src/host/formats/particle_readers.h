// What the readers of the single formats share: the table under construction, with the rules for its values.
#pragma once
#include "host/base/byte_reader.h"
#include "host/formats/particles.h"

namespace wisp {

enum class Column : uint8_t { x, y, z, density, mass, smoothing_length, unused };

// Collects particles in three steps: claim the columns that the file has, set the count once it was compared with the
// bytes left, store each value. Errors are those of the reader, about the item that it read last.
class ParticleBuilder {
  public:
    explicit ParticleBuilder(ByteReader &reader) : reader_(reader) {}

    // The column of a scalar attribute, from now on part of the table; Column::unused if it is none of them. Fails if
    // the column was claimed before.
    Column claim(std::string_view attribute);
    Column claim(Column column);
    bool is_claimed(Column column) const { return claimed_[static_cast<size_t>(column)]; }

    // Gives every claimed column `count` values. May be called again after further claims.
    void set_count(size_t count);

    // Fails if the value is not allowed there.
    void store(Column column, size_t particle, double value);

    void set_has_faces() { particles_.has_faces = true; }

    Particles take() { return std::move(particles_); }

  private:
    std::vector<double> &values(Column column);

    ByteReader &reader_;
    Particles particles_;
    bool claimed_[static_cast<size_t>(Column::unused)] = {};
};

// Each reads one format from the reader's first byte on.
Particles parse_vtk(ByteReader &reader);
Particles parse_bgeo(ByteReader &reader);
Particles parse_ply(ByteReader &reader);

} // namespace wisp
