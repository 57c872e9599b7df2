#include "host/base/files.h"
#include "host/base/text.h"
#include "host/commands/arguments.h"
#include "host/commands/commands.h"
#include "host/commands/file_facts.h"
#include "host/commands/scene_facts.h"
#include "host/formats/particles.h"
#include "host/formats/volume.h"
#include "host/images/exr.h"
#include "host/images/picture.h"
#include "host/images/texture_readers.h"
#include "host/prepare/chosen_scene.h"
#include "host/results/map_file.h"
#include "host/results/passes.h"
#include "host/results/picture_record.h"
#include <algorithm>
#include <cstdio>
#include <filesystem>

namespace wisp {

namespace {

struct InfoOptions {
    bool json = false;
};

const OptionTable<InfoOptions> &info_options() {
    static const OptionTable<InfoOptions> table = {
        {"json", nullptr, "JSON instead of text", to_switch(&InfoOptions::json)},
    };
    return table;
}

struct Kind {
    const char *name;
    bool (*is)(const Bytes &bytes); // by content; nullptr: only the name tells
    std::vector<const char *> endings;
    void (*add)(Facts &facts, const std::string &path, const Bytes &bytes);
};

const std::vector<Kind> &kinds() {
    static const std::vector<Kind> table = {
        {"particles",
         [](const Bytes &bytes) { return is_particles(bytes.data(), bytes.size()); },
         {".vtk", ".bgeo", ".ply"},
         add_particle_file},
        {"density grid",
         [](const Bytes &bytes) { return is_volume(bytes.data(), bytes.size()); },
         {".vol", ".nvdb", ".vdb"},
         add_grid_file},
        {"scene",
         nullptr,
         {".aff", ".nff"},
         [](Facts &facts, const std::string &path, const Bytes &) { add_scene_file(facts, path); }},
        {"particle map", is_map, {".map"}, add_map_file},
        {"passes of --reference", is_passes, {".passes"}, add_passes_file},
        {"picture, linear 32-bit values", is_pfm, {".pfm"}, add_pfm_file},
        {"picture, linear values", is_exr, {".exr"}, add_exr_file},
        {"picture, 8-bit sRGB values", is_png, {".png"}, add_png_file},
        {"picture, 8-bit sRGB values", nullptr, {".ppm"}, add_ppm_file},
        {"record of a picture", is_record, {".wisp"}, add_record_file},
    };
    return table;
}

// By content where that tells, else by the end of the name.
const Kind &kind_of(const std::string &path, const Bytes &bytes) {
    std::string endings;
    for (const Kind &kind : kinds())
        if (kind.is && kind.is(bytes)) return kind;
    for (const Kind &kind : kinds())
        for (const char *ending : kind.endings) {
            if (ends_in(lower_case(path), ending)) return kind;
            endings += std::string(endings.empty() ? "" : " ") + ending;
        }
    throw InputError(path, "neither its content nor its name tells what it is, expected one of " + endings);
}

Facts facts_of(const std::string &path) {
    const Bytes bytes = read_plain_file(path);
    const Kind &kind = kind_of(path, bytes);
    Facts facts;
    facts.word("file", path).word("kind", kind.name).count("file_bytes", bytes.size());
    kind.add(facts, path, bytes);
    return facts;
}

// What `wisp render` chooses for a file of smoke by itself.
void add_choice(Facts &facts, const std::string &path) {
    try {
        const SceneFile scene = ChosenScene(path, {}).scene();
        Facts chosen;
        if (scene.smokes[0].radius) chosen.number("smoothing_length", *scene.smokes[0].radius);
        if (scene.smokes[0].mass) chosen.number("mass", *scene.smokes[0].mass);
        chosen.number("extinction", *scene.smokes[0].extinction).point("eye", scene.view->from);
        chosen.point("at", scene.view->at).integers("size", {scene.view->width, scene.view->height});
        facts.group("render_chooses", chosen);
        add_optical_depth(facts, read_request({{path}, {{"quiet", "1"}}})); // what is missing is said above
    } catch (const InputError &error) {
        facts.none("render_chooses", error.text);
    }
}

Facts facts_of_sequence(const std::string &pattern) {
    const std::vector<int64_t> numbers = numbers_of_files(pattern);
    if (numbers.empty()) throw InputError(pattern, "no file has such a name and a number in place of its '%d'");
    Facts facts;
    facts.word("file", pattern).word("kind", "sequence").count("files", numbers.size());
    facts.integers("numbers", {numbers.front(), numbers.back()}, " to ");
    facts.count("missing", static_cast<uint64_t>(numbers.back() - numbers.front()) + 1 - numbers.size());
    facts.group("first", facts_of(numbered(pattern, numbers.front())));
    facts.group("last", facts_of(numbered(pattern, numbers.back())));
    add_choice(facts, pattern);
    return facts;
}

} // namespace

std::string info_help() { return help_lines(info_options()); }

int info_command(const std::vector<std::string> &arguments) {
    CommandLine line = parse_arguments("info", info_options(), arguments);
    InfoOptions options;
    take_options(line, info_options(), options);
    if (line.files.size() != 1)
        throw Error(exit_usage, "'wisp info' has " + std::to_string(line.files.size()) + " files, expected one");
    const std::string &path = line.files[0];
    std::error_code ignored;
    const bool sequence = has_number(path) && !std::filesystem::exists(path, ignored);
    Facts facts = sequence ? facts_of_sequence(path) : facts_of(path);
    if (!sequence && is_smoke_file(path)) add_choice(facts, path);
    const std::string text = options.json ? facts.json() + "\n" : facts.text();
    std::fwrite(text.data(), 1, text.size(), stdout);
    return exit_done;
}

} // namespace wisp
