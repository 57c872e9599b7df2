// The words behind a command's name: files, and options written `--x V` or `--x=V`.
#pragma once
#include "host/base/option_table.h"
#include <algorithm>
#include <utility>

namespace wisp {

// An option that a command has: its name, and what its value looks like (nullptr for a switch).
struct KnownOption {
    const char *name, *value;
};
// Adds those of a table: all, or those of these names.
template <class Target>
void add_options(std::vector<KnownOption> &known, const OptionTable<Target> &table,
                 const std::vector<std::string> &names = {}) {
    for (const OptionRow<Target> &row : table)
        if (names.empty() || std::find(names.begin(), names.end(), row.name) != names.end())
            known.push_back({row.name, row.value});
}

struct CommandLine {
    std::vector<std::string> files;
    // Names without dashes, and values ("1" of a switch), in the order given. They are set later: a scene's own options
    // come first.
    std::vector<std::pair<std::string, std::string>> options;
};

// `command`: its name, for errors. Throws Error(exit_usage) for an option that is not known, and for one whose value is
// missing or is an option itself.
CommandLine parse_arguments(const std::string &command, const std::vector<KnownOption> &known,
                            const std::vector<std::string> &arguments);

// The same with the options of one table: all, or those of these names.
template <class Target>
CommandLine parse_arguments(const std::string &command, const OptionTable<Target> &table,
                            const std::vector<std::string> &arguments, const std::vector<std::string> &names = {}) {
    std::vector<KnownOption> known;
    add_options(known, table, names);
    return parse_arguments(command, known, arguments);
}

// Sets the options of the table in `target`, and takes them out of the line.
template <class Target> void take_options(CommandLine &line, const OptionTable<Target> &table, Target &target) {
    std::vector<std::pair<std::string, std::string>> others;
    for (const auto &[name, value] : line.options)
        if (find_option(table, name))
            set_option(table, target, name, value);
        else
            others.emplace_back(name, value);
    line.options = others;
}

} // namespace wisp
