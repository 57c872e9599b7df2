// Options as tables: one row says an option's name, its help, and how its value is set in a Target. The command line of
// every command and the `render KEY VALUE` statements of a scene are read through such tables.
//
// Numbers are decimal and finite, as base/text.h reads them. CLI11 2.1 was tried instead: it takes `nan`, reads 070 as
// 56 and 0x10 as 16, takes `-1` for a file and `--digest=no` without a word, and says less in its errors.
#pragma once
#include "host/base/error.h"
#include "host/base/text.h"
#include <algorithm>
#include <functional>

namespace wisp {

// A value that an option refuses: the text is what was expected. set_option() puts the option and its value in front.
struct OptionError {
    std::string expected;
};

template <class Target> struct OptionRow {
    const char *name;  // without dashes
    const char *value; // what help shows for the value; nullptr for a switch, which is set by "1"
    const char *help;
    std::function<void(Target &, const std::string &value)> set; // throws OptionError
};
template <class Target> using OptionTable = std::vector<OptionRow<Target>>;

template <class Target>
const OptionRow<Target> *find_option(const OptionTable<Target> &table, const std::string &name) {
    for (const OptionRow<Target> &row : table)
        if (name == row.name) return &row;
    return nullptr;
}

template <class Target> std::vector<std::string> option_names(const OptionTable<Target> &table) {
    std::vector<std::string> names;
    for (const OptionRow<Target> &row : table) names.push_back(row.name);
    return names;
}

// Sets the option `name` of `target`. Throws Error(exit_usage) for a name that the table does not have and for a value
// that the option refuses; `where` is the error's place.
template <class Target>
void set_option(const OptionTable<Target> &table, Target &target, const std::string &name, const std::string &value,
                const std::string &where = "") {
    const OptionRow<Target> *row = find_option(table, name);
    if (!row)
        throw Error(exit_usage, where,
                    "there is no option '" + name + "'; 'wisp help' lists them" +
                        did_you_mean(name, option_names(table)));
    try {
        if (!row->value && value != "1") throw OptionError{"1"};
        row->set(target, value);
    } catch (const OptionError &error) {
        throw Error(exit_usage, where, "option '" + name + "': found '" + value + "', expected " + error.expected);
    }
}

// The table as lines of help: all options, or those of these names.
template <class Target>
std::string help_lines(const OptionTable<Target> &table, const std::vector<std::string> &names = {}) {
    std::string text;
    for (const OptionRow<Target> &row : table) {
        if (!names.empty() && std::find(names.begin(), names.end(), row.name) == names.end()) continue;
        const std::string option = std::string("  --") + row.name + (row.value ? std::string(" ") + row.value : "");
        text += in_columns(option, row.help);
    }
    return text;
}

// Values, checked. Each throws OptionError.

inline int64_t in_range(std::optional<int64_t> number, int64_t low, int64_t high) {
    if (!number || *number < low || *number > high)
        throw OptionError{"a whole number from " + std::to_string(low) + " to " + std::to_string(high)};
    return *number;
}

inline int64_t integer_in(const std::string &value, int64_t low, int64_t high) {
    return in_range(to_integer(value), low, high);
}

// How many there are of something, as to_count() reads it.
inline int64_t count_in(const std::string &value, int64_t low, int64_t high) {
    return in_range(to_count(value), low, high);
}

// A number for which `accepts` is true, else what was expected.
template <class Accepts> double number_that(const std::string &value, Accepts accepts, const std::string &expected) {
    const auto number = to_number(value);
    if (!number || !accepts(*number)) throw OptionError{expected};
    return *number;
}

// The index of the word.
inline size_t one_of(const std::string &value, const std::vector<std::string> &words) {
    std::string expected;
    for (size_t i = 0; i < words.size(); ++i) {
        if (value == words[i]) return i;
        expected += (i ? ", " : "") + words[i];
    }
    throw OptionError{expected + did_you_mean(value, words)};
}

// Rows' `set`, for a member of the target.

template <class Target> auto to_switch(bool Target::*member) {
    return [member](Target &target, const std::string &) { target.*member = true; };
}

template <class Target> auto to_text(std::string Target::*member) {
    return [member](Target &target, const std::string &value) { target.*member = value; };
}

// Number, or std::optional of one.
template <class Target, class Number> auto to_count_in(Number Target::*member, int64_t low, int64_t high) {
    return [=](Target &target, const std::string &value) {
        target.*member = static_cast<Number>(count_in(value, low, high));
    };
}

// Enumeration, or std::optional of one; the words stand in the order of its values.
template <class Target, class Enumeration>
auto to_word(Enumeration Target::*member, const std::vector<std::string> &words) {
    return [=](Target &target, const std::string &value) {
        target.*member = static_cast<Enumeration>(one_of(value, words));
    };
}
template <class Target, class Enumeration>
auto to_word(std::optional<Enumeration> Target::*member, const std::vector<std::string> &words) {
    return [=](Target &target, const std::string &value) {
        target.*member = static_cast<Enumeration>(one_of(value, words));
    };
}

} // namespace wisp
