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

// `text` with small letters.
std::string lower_case(std::string_view text);

// One line whatever bytes a file or an argument put into it: control characters and bytes that are not UTF-8 become
// `\n`, `\t`, `\r` or `\xNN`.
std::string printable(std::string_view text);

// `; did you mean 'WORD'?` with the one of `words` that `word` is a slip of: but for case, few letters differ, or it is
// cut short. Empty where there is none.
std::string did_you_mean(std::string_view word, const std::vector<std::string> &words, const std::string &dashes = "");

// The number that all of `text` is, in decimal; nothing where it is none. A double is finite, and may have a sign `+`.
std::optional<double> to_number(std::string_view text);
std::optional<int64_t> to_integer(std::string_view text);

// A count as people write it: `250000`, `2.5e5`, `250k`, `0.25M`, where k is a thousand, M a million and G a thousand
// millions. Nothing where the text is none of these, is no whole number or is above the largest int64_t; digits alone
// may have a sign `-`.
std::optional<int64_t> to_count(std::string_view text);

// `left`, and `right` beside it from column 31 on, in lines of at most 100 characters.
std::string in_columns(const std::string &left, const std::string &right);

// For people: `1.2`, `0.00034`, `5.6e+07` with two digits.
std::string digits_of(double number, int digits);
std::string two_digits(double number);
std::string six_digits(double number);

// `pattern` with the number in place of its first `%d` or `%04d` (one or two digits); the pattern itself without one.
std::string numbered(const std::string &pattern, int64_t number);
bool has_number(const std::string &pattern);
// The number with which `pattern` is `name`; nothing where there is none.
std::optional<int64_t> number_in(const std::string &pattern, const std::string &name);

} // namespace wisp
