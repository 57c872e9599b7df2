#include "host/commands/arguments.h"

namespace wisp {

namespace {

// A command with few options names them all.
[[noreturn]] void refuse(const std::string &command, const std::vector<KnownOption> &known, const std::string &name) {
    const std::string none = "there is no option '" + name + "'";
    std::vector<std::string> names;
    for (const KnownOption &option : known) names.push_back(option.name);
    const size_t dashes = name.find_first_not_of('-');
    const std::string meant = dashes == std::string::npos ? "" : did_you_mean(name.substr(dashes), names, "--");
    if (known.size() > 8) throw Error(exit_usage, none + "; 'wisp help' lists them" + meant);
    std::string expected;
    for (size_t i = 0; i < known.size(); ++i)
        expected += (i == 0 ? "--" : i + 1 < known.size() ? ", --" : " or --") + std::string(known[i].name);
    throw Error(exit_usage, none + " of " + command + ", expected " + expected + meant);
}

// `-o` is `--output`. Other words stay as they are.
std::string whole_name(const std::string &word) {
    for (const auto &[letter, whole] : {std::pair("-o", "--output"), {"-q", "--quiet"}, {"-v", "--verbose"}})
        if (word == letter) return whole;
    return word;
}

// The word behind an option is its value, unless it is an option itself.
void check_value(const std::string &option, const std::string &value) {
    const std::string name = whole_name(value.substr(0, value.find('=')));
    if (name.size() > 2 && name.compare(0, 2, "--") == 0)
        throw Error(exit_usage, "the value of '" + option + "' is '" + value + "', which is an option: was the value " +
                                    "forgotten? '" + option + "=" + value + "' takes it as it is");
}

} // namespace

CommandLine parse_arguments(const std::string &command, const std::vector<KnownOption> &known,
                            const std::vector<std::string> &arguments) {
    CommandLine line;
    for (size_t i = 0; i < arguments.size(); ++i) {
        const std::string &word = arguments[i];
        if (word.size() < 2 || word[0] != '-') {
            line.files.push_back(word);
            continue;
        }
        const size_t equals = word.find('=');
        const std::string name = whole_name(word.substr(0, equals));
        const auto option = std::find_if(known.begin(), known.end(),
                                         [&](const KnownOption &o) { return name == std::string("--") + o.name; });
        if (option == known.end()) refuse(command, known, word.substr(0, equals));
        std::string value = "1"; // of a switch
        if (!option->value) {
            if (equals != std::string::npos) throw Error(exit_usage, "option '" + name + "' takes no value");
        } else if (equals != std::string::npos) {
            value = word.substr(equals + 1);
        } else if (++i < arguments.size()) {
            value = arguments[i];
            check_value(name, value);
        } else {
            throw Error(exit_usage, "option '" + name + "' needs a value: " + option->value);
        }
        line.options.emplace_back(option->name, value);
    }
    return line;
}

} // namespace wisp
