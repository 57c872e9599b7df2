// Any bytes read as particles give a table whose numbers are valid, or an InputError of one line.
#include "host/base/error.h"
#include "host/base/text.h"
#include "host/formats/particles.h"
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace {

void promise(bool holds) {
    if (!holds) std::abort();
}

void check_column(const std::vector<double> &values, size_t count) {
    promise(values.empty() || values.size() == count);
    for (double value : values) promise(std::isfinite(value));
}

void check_table(const wisp::Particles &particles) {
    const size_t count = particles.position.size();
    for (const auto &point : particles.position)
        for (double coordinate : point) promise(std::isfinite(coordinate));
    check_column(particles.density, count);
    check_column(particles.mass, count);
    check_column(particles.smoothing_length, count);
    for (double mass : particles.mass) promise(mass >= 0);
    for (double length : particles.smoothing_length) promise(length > 0);
}

void check_error(const std::string &line) {
    promise(line.rfind("name:", 0) == 0);
    promise(line.size() < 400);
    promise(line == wisp::printable(line));
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    try {
        check_table(wisp::parse_particles("name", data, size));
    } catch (const wisp::InputError &error) {
        check_error(error.what());
    }
    return 0;
}
