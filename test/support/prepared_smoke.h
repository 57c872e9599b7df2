// A scene as the host prepares it from text.
#pragma once
#include "core/numbers/real.h"
#include "host/prepare/prepare.h"
#include "support/temporary_folder.h"
#include <fstream>

namespace wisp::WISP_ARITH {

// The text may name the file p.vtk: 40 particles without attributes in a cube with edge `size`.
class PreparedSmoke {
  public:
    explicit PreparedSmoke(const std::string &text, double size = 1) {
        std::ofstream file(folder_.file("p.vtk"));
        file.precision(17);
        file << "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 40 double\n";
        uint32_t state = 9;
        for (int i = 0; i < 120; ++i) {
            state = state * 1664525u + 1013904223u;
            file << ((state >> 8) * 0x1p-24 - 0.5) * size << " ";
        }
        file.close();
        Options options;
        options.arithmetic = Arithmetic::WISP_ARITH;
        prepare_scene("s.aff", parse_scene(folder_.file("s.aff"), text), options, 0, prepared_);
    }
    const Scene &scene() const { return prepared_.scene; }

  private:
    TemporaryFolder folder_;
    PreparedScene prepared_;
};

} // namespace wisp::WISP_ARITH
