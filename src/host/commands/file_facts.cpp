#include "core/smoke/grid_samples.h"
#include "host/base/double3_algebra.h"
#include "host/base/memory.h"
#include "host/base/sha256.h"
#include "host/base/text.h"
#include "host/commands/file_facts.h"
#include "host/formats/particles.h"
#include "host/formats/volume.h"
#include "host/images/exr.h"
#include "host/images/texture_readers.h"
#include "host/prepare/particle_sample.h"
#include "host/results/map_file.h"
#include "host/results/passes.h"
#include "host/results/picture_record.h"
#include "wisp/photon_sums.h"
#include <cmath>
#include <filesystem>
#include <type_traits>

namespace wisp {

namespace {

Double3 double3(const std::array<double, 3> &v) { return {v[0], v[1], v[2]}; }

template <class Numbers> Spread spread_of(const Numbers &numbers) {
    Spread spread;
    for (const auto number : numbers) spread.add(static_cast<double>(number));
    return spread;
}

void add_ranges(Facts &facts, const char *name, const Ranges &ranges) {
    std::string json;
    for (const auto &[first, last] : ranges)
        json += (json.empty() ? "[" : ", [") + std::to_string(first) + ", " + std::to_string(last) + "]";
    facts.add(name, ranges.empty() ? "none" : ranges_text(ranges).substr(1), "[" + json + "]");
}

// R G B, R G B ... of a picture.
template <class Value> void add_channels(Facts &facts, int width, int height, const std::vector<Value> &values) {
    Spread spreads[3];
    for (size_t i = 0; i < values.size(); ++i) spreads[i % 3].add(static_cast<double>(values[i]));
    facts.integers("size", {width, height});
    facts.spread("red", spreads[0]).spread("green", spreads[1]).spread("blue", spreads[2]);
    if (std::is_integral_v<Value>) return;
    facts.count("nan", spreads[0].nans() + spreads[1].nans() + spreads[2].nans());
    facts.count("infinite", spreads[0].infinities() + spreads[1].infinities() + spreads[2].infinities());
}

void add_texels(Facts &facts, const Texels &texels) { add_channels(facts, texels.width, texels.height, texels.rgb); }

void add_record(Facts &facts, const PictureRecord &record) {
    const Crop &crop = record.crop;
    facts.integers("whole_picture", {record.width, record.height});
    facts.integers("crop", {crop.x0, crop.y0, crop.x1, crop.y1}, ",");
    if (record.exposure) facts.number("exposure", *record.exposure);
    facts.word("fingerprint", record.scene);
}

// `picture`: the bytes that the record should be of.
void add_record_of(Facts &facts, const SavedRecord &saved, const Bytes &picture) {
    Facts record;
    add_record(record, saved.record);
    record.flag("unchanged", sha256(picture.data(), picture.size()).text == saved.sha256);
    facts.group("record", record);
}

double root_mean_square(const std::vector<float> &values) {
    double sum = 0;
    for (const float value : values) sum += static_cast<double>(value) * static_cast<double>(value);
    return std::sqrt(sum / static_cast<double>(values.size()));
}

} // namespace

void add_particles(Facts &facts, const std::vector<Particle> &particles, const Double3 &center, double scale) {
    facts.count("particles", particles.size());
    if (particles.empty()) return;
    Spread x, y, z, h;
    for (const Particle &particle : particles) {
        x.add(particle.position.x / scale + center.x);
        y.add(particle.position.y / scale + center.y);
        z.add(particle.position.z / scale + center.z);
        h.add(particle.h / scale);
    }
    facts.point("low", {x.low(), y.low(), z.low()}).point("high", {x.high(), y.high(), z.high()});
    const ParticleSample sample = sample_particles(particles);
    const std::string of = " of " + std::to_string(sample.count) + " particles";
    if (sample.spacing) {
        const double spacing = *sample.spacing / scale;
        facts.add("spacing", six_digits(spacing) + ", the median distance to the nearest" + of, exact(spacing));
    }
    if (sample.neighbours)
        facts.add("neighbours", six_digits(*sample.neighbours) + " in a support, the mean" + of,
                  exact(*sample.neighbours));
    if (h.high() > 0)
        facts.spread("smoothing_length", h);
    else
        facts.none("smoothing_length", "the file has none");
}

void add_particle_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    const Particles table = parse_particles(path, bytes.data(), bytes.size());
    const size_t count = table.position.size();
    require_memory(path, "the table of particles", 2 * count * sizeof(Particle)); // some are sorted
    std::vector<Particle> particles(count);
    for (size_t i = 0; i < count; ++i)
        particles[i] = {double3(table.position[i]), table.smoothing_length.empty() ? 0 : table.smoothing_length[i], 0};
    facts.word("format", table.format);
    add_particles(facts, particles, {0, 0, 0}, 1);
    if (!table.mass.empty())
        facts.spread("mass", spread_of(table.mass));
    else if (count > 0)
        facts.none("mass", "the file has none");
    if (!table.density.empty()) facts.spread("density", spread_of(table.density));
    if (table.has_faces) facts.add("faces", "not used: its vertices are taken for particles", "true");
    if (table.has_particle_radius) facts.add("particle_radius", "not used: it is no smoothing length", "true");
}

void add_grid_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    const Volume volume = parse_volume(path, bytes.data(), bytes.size());
    const Double3 low = double3(volume.low), high = double3(volume.high), size = high - low;
    const auto &[right, up, back] = volume.axis;
    Spread x, y, z; // of the corners: exactly those of the file where it is not turned
    for (int i = 0; i < 8; ++i) {
        const Double3 corner = corner_of_box(low, high, i), p = right * corner.x + up * corner.y + back * corner.z;
        x.add(p.x), y.add(p.y), z.add(p.z);
    }
    if (!volume.names.empty()) facts.word("grid", volume.name).words("grids", volume.names); // `grid`: the one read
    GridDescription grid = {};
    volume.describe_samples(grid);
    Spread spread;
    uint64_t filled = 0, empty = samples_of_box(grid);
    for_each_run(grid, [&](int32_t, int32_t, int32_t, const float *densities, int32_t count) {
        for (int32_t i = 0; i < count; ++i) {
            spread.add(static_cast<double>(densities[i]));
            filled += densities[i] > 0;
        }
        empty -= static_cast<uint64_t>(count);
        return true;
    });
    if (empty > 0) spread.add(0, empty);
    facts.integers("cells", {volume.nx, volume.ny, volume.nz}).point("low", {x.low(), y.low(), z.low()});
    facts.point("high", {x.high(), y.high(), z.high()});
    facts.point("cell_size", {size.x / volume.nx, size.y / volume.ny, size.z / volume.nz});
    facts.flag("turned", right.x < 1 || up.y < 1 || back.z < 1);
    facts.spread("density", spread).count("not_zero", filled);
    if (grid.blocks) facts.count("samples_in_memory", stored_samples(grid));
}

void add_map_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    const MapFile map = parse_map(bytes, path);
    const Statistics::Photons &counts = map.counts;
    const uint64_t batches = batch_count(map.photons);
    facts.count("photons", map.photons);
    facts.count("batches", batches);
    add_ranges(facts, "traced_batches", map.batches);
    facts.count("emitted", counts.emitted).count("collisions", counts.collisions).count("stored", counts.stored);
    facts.count("absorbed", counts.absorbed).count("escaped", counts.escaped).count("blocked", counts.blocked);
    facts.count("capped", counts.capped).count("sums", map.sums.size()).word("fingerprint", map.scene);
}

void add_passes_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    const Passes passes = parse_passes(bytes, path);
    add_channels(facts, passes.width, passes.height, mean_picture(passes).rgb);
    facts.number("standard_error", root_mean_square(error_picture(passes).rgb));
    facts.count("rays_a_pass", passes.samples);
    add_ranges(facts, "passes", passes.ranges);
    facts.word("fingerprint", passes.scene);
}

void add_pfm_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    const Picture picture = parse_pfm(bytes, path);
    add_channels(facts, picture.width, picture.height, picture.rgb);
    const std::string record = record_path(path);
    std::error_code ignored;
    if (std::filesystem::exists(record, ignored))
        add_record_of(facts, parse_record(read_plain_file(record), record), bytes);
}

void add_exr_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    const Picture picture = parse_exr(bytes, path);
    add_channels(facts, picture.width, picture.height, picture.rgb);
    Bytes without = bytes;
    if (const auto record = take_exr_record(without, path)) add_record_of(facts, *record, without);
}

void add_png_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    add_texels(facts, read_png(bytes, path));
    if (const auto recorded = record_in_png(bytes, path)) add_record_of(facts, recorded->saved, recorded->picture);
}

void add_ppm_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    add_texels(facts, read_ppm(bytes, path));
}

void add_record_file(Facts &facts, const std::string &path, const Bytes &bytes) {
    add_record(facts, parse_record(bytes, path).record);
}

} // namespace wisp
