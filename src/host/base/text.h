// Small functions of text: numbers, file names, lists.
#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wisp {

// Whether `text` ends in `suffix` and is longer: a file name that ends in `.png`, for instance.
bool ends_in(const std::string &text, const std::string &suffix);

// The parts of `text` between the separators; one more than there are separators.
std::vector<std::string> split(const std::string &text, char separator);

// The number that all of `text` is, in decimal; nothing where it is none. A double is finite, and may have a sign `+`.
std::optional<double> to_number(std::string_view text);
std::optional<int64_t> to_integer(std::string_view text);

// `pattern` with the number in place of its first `%d` or `%04d` (one or two digits); the pattern itself without one.
std::string numbered(const std::string &pattern, int64_t number);
bool has_number(const std::string &pattern);

} // namespace wisp
