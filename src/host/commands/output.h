// The outputs of a picture: files, their records, and the digest.
#pragma once
#include "host/images/layers.h"
#include "host/results/passes.h"
#include "host/results/picture_record.h"
#include "host/scene/options.h"
#include <optional>

namespace wisp {

// The files of some frames that are to be written. Throws Error(exit_usage) for two of one name, or for one that is
// among `read`, and Error(exit_output) for one that cannot be written; nothing is left behind.
void check_outputs(const Options &options, const Options::Frames &frames = {},
                   const std::vector<std::string> &read = {});

// Throws Error(exit_usage) if an option's file is one of those that are read, however they are spelled.
void check_not_read(const char *option, const std::string &path, const std::vector<std::string> &read);

// Writes `bytes` to the file `path`, or to standard output where it is `-` or as `-.png`; with --verbose it says so.
void write_output(const Options &options, const std::string &path, const Bytes &bytes);

// Whether the file `output` gets a record, from which a later run or `wisp stitch` knows what the file shows: a picture
// that is one of several frames, or a crop. A picture of --shadows paper depends on the frames before it, and never
// gets one.
bool carries_record(const Options &options, const std::string &output);

// The record of the file `output` of a picture: a .png depends on the exposure as well.
PictureRecord record_of(const Options &options, const std::string &output, const PictureRecord &picture);

// Prints the SHA-256 of the bytes of a .pfm, in the form that `sha256sum -c` reads.
void print_digest(const Options &options, const Bytes &pfm, int64_t frame);

// Whether an output can hold layers: an .exr in itself, a .pfm in files beside it.
bool holds_layers(const std::string &output);

// Writes every output of a picture and prints its digest. `pfm`: the picture's bytes. `passes`: the sums of
// --reference, else nullptr. `record`: of the picture, where outputs are to carry one.
void write_outputs(const Options &options, const Picture &picture, const Bytes &pfm, const Passes *passes,
                   int64_t frame, const std::optional<PictureRecord> &record = std::nullopt,
                   const PictureLayers &layers = {});

} // namespace wisp
