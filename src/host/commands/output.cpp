#include "host/base/files.h"
#include "host/base/messages.h"
#include "host/base/sha256.h"
#include "host/commands/output.h"
#include "host/images/exr.h"
#include "wisp/settings.h"
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

namespace wisp {

namespace {

bool is_standard_output(const std::string &path) {
    return path == "-" || (path.compare(0, 2, "-.") == 0 && path.find('/') == std::string::npos);
}

// A .pfm that is no stream has room for its layers beside it.
bool has_files_beside(const std::string &output) { return ends_in(output, ".pfm") && !is_standard_output(output); }

// What an option writes to.
struct Target {
    const char *option;
    std::string path;
};

std::vector<Target> targets_of(const Options &options, int64_t frame) {
    std::vector<Target> targets;
    for (const std::string &output : options.outputs) {
        targets.push_back({"output", numbered(output, frame)});
        if (carries_record(options, output) && ends_in(output, ".pfm"))
            targets.push_back({"output", record_path(numbered(output, frame))});
        if (options.layers && has_files_beside(output)) // which of them the scene has is not known yet
            for (const LayerNames &layer : layer_names())
                targets.push_back({"layers", layer_path(numbered(output, frame), layer.word)});
    }
    const Target others[] = {{"map-out", numbered(options.map_out, frame)},
                             {"error-out", numbered(options.error_out, frame)},
                             {"stats", options.stats},
                             {"write-scene", options.write_scene},
                             {"digest", options.digest ? "-" : ""}};
    for (const Target &target : others)
        if (!target.path.empty()) targets.push_back(target);
    return targets;
}

// A file's name, however it was spelled.
std::string spelled_out(const std::string &path) {
    std::error_code fault; // writing says what is wrong with a name
    const std::filesystem::path absolute = std::filesystem::absolute(path, fault);
    return (fault ? std::filesystem::path(path) : absolute).lexically_normal().string();
}

// What is written to a device adds up.
bool is_plain_or_new(const std::string &path) {
    std::error_code fault;
    return !std::filesystem::exists(path, fault) || std::filesystem::is_regular_file(path, fault);
}

// Whether they are one.
bool is_same(const std::string &a, const std::string &b) {
    if (is_standard_output(a) || is_standard_output(b)) return is_standard_output(a) && is_standard_output(b);
    return spelled_out(a) == spelled_out(b) && is_plain_or_new(a);
}

using Names = std::set<std::string>;

Names names_of(const std::vector<std::string> &files) {
    Names names;
    for (const std::string &file : files) names.insert(spelled_out(file));
    return names;
}

void check_not_among(const Names &read, const char *option, const std::string &path) {
    if (!is_standard_output(path) && read.count(spelled_out(path)) > 0 && is_plain_or_new(path))
        throw Error(exit_usage, std::string("option '") + option + "' writes to '" + path +
                                    "', which is read, expected another file");
}

void check_apart(const std::vector<Target> &targets) {
    for (size_t i = 0; i < targets.size(); ++i) {
        const std::string option = std::string("option '") + targets[i].option + "'", &path = targets[i].path;
        for (size_t j = 0; j < i; ++j)
            if (is_same(targets[j].path, path))
                throw Error(exit_usage, option + " writes to " +
                                            (is_standard_output(path) ? "standard output" : "'" + path + "'") +
                                            " like '" + targets[j].option + "', expected another file");
    }
}

bool has_numbered_folder(const Options &options) {
    for (const std::string &path : options.outputs)
        if (has_number(path.substr(0, path.rfind('/') + 1))) return true;
    return false;
}

// The name beside a digest is that of the written .pfm, so that `sha256sum -c` finds the file; "-" where none was
// written.
std::string digest_name(const Options &options, int64_t frame) {
    for (const std::string &output : options.outputs)
        if (ends_in(output, ".pfm")) return numbered(output, frame);
    return "-";
}

Bytes picture_file(const Options &options, const std::string &output, const Picture &picture, const Bytes &pfm,
                   const PictureLayers &layers) {
    if (ends_in(output, ".png")) return png_bytes(picture, options.exposure);
    return ends_in(output, ".exr") ? exr_bytes(picture, layers) : pfm;
}

} // namespace

void check_not_read(const char *option, const std::string &path, const std::vector<std::string> &read) {
    check_not_among(names_of(read), option, path);
}

void check_outputs(const Options &options, const Options::Frames &frames, const std::vector<std::string> &read) {
    const Names names = names_of(read);
    constexpr int64_t most = 100000; // frames: names of more are not compared
    const int64_t last = read.empty() ? -1 : std::min(frames.last, frames.first + most * frames.step);
    for (int64_t frame = frames.first; frame <= last; frame += frames.step)
        for (const Target &target : targets_of(options, frame)) check_not_among(names, target.option, target.path);
    // Names differ by the frame's number alone: those of the first and the last frame stand for all, unless the
    // folders are numbered.
    const int64_t stride =
        has_numbered_folder(options) ? frames.step : std::max(frames.last - frames.first, int64_t{1});
    for (int64_t frame = frames.first; frame <= frames.last; frame += stride) {
        const std::vector<Target> targets = targets_of(options, frame);
        check_apart(targets);
        for (const Target &target : targets)
            if (!is_standard_output(target.path)) check_writable(target.path);
    }
}

void write_output(const Options &options, const std::string &path, const Bytes &bytes) {
    if (is_standard_output(path)) {
        std::fwrite(bytes.data(), 1, bytes.size(), stdout); // main() looks for its errors
        return;
    }
    write_file(path, bytes);
    if (options.verbose) print_note("wrote " + path);
}

bool holds_layers(const std::string &output) { return ends_in(output, ".exr") || has_files_beside(output); }

bool carries_record(const Options &options, const std::string &output) {
    return (options.crop || has_number(output)) && !ends_in(output, ".passes") && !is_standard_output(output) &&
           options.shadows != ShadowMethod::paper;
}

void print_digest(const Options &options, const Bytes &pfm, int64_t frame) {
    std::printf("%s  %s\n", sha256(pfm.data(), pfm.size()).text, digest_name(options, frame).c_str());
}

PictureRecord record_of(const Options &options, const std::string &output, const PictureRecord &picture) {
    PictureRecord record = picture;
    if (ends_in(output, ".png")) record.exposure = options.exposure;
    return record;
}

void write_outputs(const Options &options, const Picture &picture, const Bytes &pfm, const Passes *passes,
                   int64_t frame, const std::optional<PictureRecord> &record, const PictureLayers &layers) {
    for (const std::string &output : options.outputs) {
        const std::string path = numbered(output, frame);
        if (ends_in(output, ".passes")) {
            write_output(options, path, passes_bytes(*passes));
            continue;
        }
        if (has_files_beside(output))
            for_each_layer(picture, layers, [&](const LayerNames &names, const float *plane) {
                write_output(options, layer_path(path, names.word),
                             pfm_bytes(picture.width, picture.height, plane, names.channels.size()));
            });
        const Bytes bytes = picture_file(options, output, picture, pfm, layers);
        if (!record || !carries_record(options, output)) {
            write_output(options, path, bytes);
            continue;
        }
        write_recorded(path, bytes, record_of(options, output, *record));
        if (options.verbose) print_note("wrote " + path);
    }
    if (!options.error_out.empty())
        write_output(options, numbered(options.error_out, frame), pfm_bytes(error_picture(*passes)));
    if (options.digest) print_digest(options, pfm, frame);
}

} // namespace wisp
