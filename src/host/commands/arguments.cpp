#include "host/commands/arguments.h"

namespace wisp {

namespace {

// A command with few options names them all.
[[noreturn]] void refuse(const std::string &command, const std::vector<KnownOption> &known, const std::string &name) {
    if (known.size() > 8) throw Error(exit_usage, "there is no option '" + name + "'; 'wisp help' lists them");
    std::string expected;
    for (size_t i = 0; i < known.size(); ++i)
        expected += (i == 0 ? "--" : i + 1 < known.size() ? ", --" : " or --") + std::string(known[i].name);
    throw Error(exit_usage, "there is no option '" + name + "' of " + command + ", expected " + expected);
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
        std::string name = word.substr(0, equals);
        for (const auto &[letter, whole] : {std::pair("-o", "--output"), {"-q", "--quiet"}, {"-v", "--verbose"}})
            if (name == letter) name = whole;
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
        } else {
            throw Error(exit_usage, "option '" + name + "' needs a value: " + option->value);
        }
        line.options.emplace_back(option->name, value);
    }
    return line;
}

} // namespace wisp
