#include "host/base/files.h"
#include "host/base/sha256.h"
#include "host/commands/output.h"
#include "wisp/settings.h"
#include <cstdio>

namespace wisp {

namespace {

// The name beside a digest is that of the written .pfm, so that `sha256sum -c` finds the file; "-" where none was
// written.
std::string digest_name(const Options &options, int64_t frame) {
    for (const std::string &output : options.outputs)
        if (ends_in(output, ".pfm")) return numbered(output, frame);
    return "-";
}

} // namespace

void write_output(const Options &options, const std::string &path, const Bytes &bytes) {
    write_file(path, bytes);
    if (options.verbose) std::fprintf(stderr, "wrote %s\n", path.c_str());
}

bool carries_record(const Options &options, const std::string &output) {
    return (options.crop || has_number(output)) && !ends_in(output, ".passes") &&
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
                   int64_t frame, const std::optional<PictureRecord> &record) {
    for (const std::string &output : options.outputs) {
        const std::string path = numbered(output, frame);
        if (ends_in(output, ".passes")) {
            write_output(options, path, passes_bytes(*passes));
            continue;
        }
        const Bytes bytes = ends_in(output, ".png") ? png_bytes(picture, options.exposure) : pfm;
        if (!record || !carries_record(options, output)) {
            write_output(options, path, bytes);
            continue;
        }
        write_recorded(path, bytes, record_of(options, output, *record));
        if (options.verbose) std::fprintf(stderr, "wrote %s\n", path.c_str());
    }
    if (!options.error_out.empty())
        write_output(options, numbered(options.error_out, frame), pfm_bytes(error_picture(*passes)));
    if (options.digest) print_digest(options, pfm, frame);
}

} // namespace wisp
