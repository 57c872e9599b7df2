#include "host/base/text.h"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace wisp {

namespace {

// Bytes of the UTF-8 character at the start of `text`, which is not empty; 0 where there is none.
size_t character_size(std::string_view text) {
    const auto byte = [text](size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0; };
    const int lead = byte(0);
    if (lead < 0x80) return 1;
    const size_t size = lead < 0xc2 || lead > 0xf4 ? 0 : lead < 0xe0 ? 2 : lead < 0xf0 ? 3 : 4;
    for (size_t i = 1; i < size; ++i)
        if (byte(i) < 0x80 || byte(i) > 0xbf) return 0;
    // Longer than needed, surrogates, beyond the last character.
    const int next = byte(1);
    if ((lead == 0xe0 && next < 0xa0) || (lead == 0xed && next > 0x9f) || (lead == 0xf0 && next < 0x90) ||
        (lead == 0xf4 && next > 0x8f))
        return 0;
    return size;
}

// Of a character: of one byte, or of the two that stand for 0x80 to 0x9f.
bool is_control(std::string_view character) {
    const unsigned char first = static_cast<unsigned char>(character[0]);
    return character.size() == 1 ? first < ' ' || first == 127
                                 : first == 0xc2 && static_cast<unsigned char>(character[1]) < 0xa0;
}

std::string escaped(std::string_view bytes) {
    constexpr char digits[] = "0123456789abcdef";
    std::string text;
    for (char c : bytes) {
        const auto byte = static_cast<unsigned char>(c);
        text += c == '\n'   ? std::string("\\n")
                : c == '\t' ? "\\t"
                : c == '\r' ? "\\r"
                            : std::string("\\x") + digits[byte >> 4] + digits[byte & 15];
    }
    return text;
}

// How many letters are to be changed, added, left out or exchanged with the next.
size_t distance(const std::string &a, const std::string &b) {
    std::vector<std::vector<size_t>> d(a.size() + 1, std::vector<size_t>(b.size() + 1));
    for (size_t i = 0; i <= a.size(); ++i)
        for (size_t j = 0; j <= b.size(); ++j) {
            if (i == 0 || j == 0) {
                d[i][j] = i + j;
                continue;
            }
            d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
            if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
                d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
        }
    return d[a.size()][b.size()];
}

} // namespace

std::string printable(std::string_view text) {
    std::string line;
    while (!text.empty()) {
        const size_t size = character_size(text);
        const std::string_view character = text.substr(0, size ? size : 1);
        line += size && !is_control(character) ? std::string(character) : escaped(character);
        text.remove_prefix(character.size());
    }
    return line;
}

std::string did_you_mean(std::string_view word, const std::vector<std::string> &words, const std::string &dashes) {
    constexpr size_t longest = 32; // what is longer is no slip
    if (word.size() > longest) return "";
    const std::string small = lower_case(word);
    size_t nearest = 1 + std::max<size_t>(1, small.size() / 3);
    std::string found;
    for (const std::string &other : words) {
        const bool cut_short = small.size() >= 3 && other.compare(0, small.size(), small) == 0;
        const size_t d = cut_short ? 1 : distance(small, lower_case(other));
        if (d >= nearest || d >= other.size()) continue;
        nearest = d;
        found = other;
    }
    return found.empty() ? "" : "; did you mean '" + dashes + found + "'?";
}

std::string lower_case(std::string_view text) {
    std::string result(text);
    for (char &c : result)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return result;
}

bool ends_in(const std::string &text, const std::string &suffix) {
    return text.size() > suffix.size() && text.compare(text.size() - suffix.size(), suffix.size(), suffix) == 0;
}

std::vector<std::string> split(const std::string &text, char separator) {
    std::vector<std::string> parts(1);
    for (char c : text)
        if (c == separator)
            parts.emplace_back();
        else
            parts.back() += c;
    return parts;
}

std::optional<double> to_number(std::string_view text) {
    double number = 0;
    const bool plus = text.size() > 1 && text[0] == '+' && text[1] != '-';
    const char *begin = text.data() + (plus ? 1 : 0), *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(begin, last, number);
    if (error != std::errc() || end != last || !std::isfinite(number)) return std::nullopt;
    return number;
}

std::optional<int64_t> to_integer(std::string_view text) {
    int64_t number = 0;
    const char *last = text.data() + text.size();
    const auto [end, error] = std::from_chars(text.data(), last, number);
    if (error != std::errc() || end != last) return std::nullopt;
    return number;
}

namespace {

// Takes the power of ten off the end of a count: that of `e5`, `e+05`, `k`, `M` or `G`, or 0. Nothing for an exponent
// that is not one or that no count has.
std::optional<size_t> take_power(std::string_view &text) {
    static constexpr std::string_view letters = "kMG";
    if (text.empty()) return std::nullopt;
    if (const size_t letter = letters.find(text.back()); letter != letters.npos) {
        text.remove_suffix(1);
        return 3 * (letter + 1);
    }
    const size_t e = text.find_first_of("eE");
    if (e == text.npos) return 0;
    std::string_view exponent = text.substr(e + 1);
    if (exponent.substr(0, 1) == "+") exponent.remove_prefix(1);
    const auto power = exponent.substr(0, 1) == "-" ? std::nullopt : to_integer(exponent);
    if (!power || *power > std::numeric_limits<int64_t>::digits10) return std::nullopt;
    text = text.substr(0, e);
    return static_cast<size_t>(*power);
}

} // namespace

std::optional<int64_t> to_count(std::string_view text) {
    static constexpr const char *digits = "0123456789";
    if (const auto number = to_integer(text)) return number;
    const auto power = take_power(text);
    if (!power || text.find_first_of(digits) == text.npos ||
        text.find_first_not_of(digits + std::string(".")) != text.npos)
        return std::nullopt;
    const size_t point = std::min(text.find('.'), text.size());
    const std::string whole(text.substr(0, point));
    std::string fraction(text.substr(std::min(point + 1, text.size())));
    while (!fraction.empty() && fraction.back() == '0') fraction.pop_back();
    if (fraction.size() > *power) return std::nullopt;
    return to_integer(whole + fraction + std::string(*power - fraction.size(), '0'));
}

std::string in_columns(const std::string &left, const std::string &right) {
    constexpr size_t column = 31, width = 100;
    const std::string margin(column - 1, ' ');
    std::string text, line = left;
    if (left.size() >= column)
        text = left + "\n", line = margin;
    else
        line.resize(column - 1, ' ');
    for (const std::string &word : split(right, ' ')) {
        if (line.size() + 1 + word.size() > width) {
            text += line + "\n";
            line = margin;
        }
        line += " " + word;
    }
    return text + line + "\n";
}

std::string digits_of(double number, int digits) {
    char text[32];
    std::snprintf(text, sizeof text, "%.*g", digits, number + 0.0); // -0 is 0
    return text;
}
std::string two_digits(double number) { return digits_of(number, 2); }
std::string six_digits(double number) { return digits_of(number, 6); }

namespace {

// Where `%d` or `%04d` stands in a pattern: begin, end, and the digits wanted.
bool find_number(const std::string &pattern, size_t &begin, size_t &end, size_t &digits) {
    for (begin = pattern.find('%'); begin != std::string::npos; begin = pattern.find('%', begin + 1)) {
        end = begin + 1;
        while (end < pattern.size() && pattern[end] >= '0' && pattern[end] <= '9') ++end;
        if (end >= pattern.size() || pattern[end] != 'd' || end - begin > 3) continue;
        digits = end > begin + 1 ? static_cast<size_t>(std::atoi(pattern.c_str() + begin + 1)) : 0;
        ++end;
        return true;
    }
    return false;
}

} // namespace

std::string numbered(const std::string &pattern, int64_t number) {
    size_t begin, end, digits;
    if (!find_number(pattern, begin, end, digits)) return pattern;
    std::string text = std::to_string(number < 0 ? -number : number);
    if (text.size() < digits) text.insert(0, digits - text.size(), '0');
    return pattern.substr(0, begin) + (number < 0 ? "-" : "") + text + pattern.substr(end);
}

bool has_number(const std::string &pattern) {
    size_t begin, end, digits;
    return find_number(pattern, begin, end, digits);
}

std::optional<int64_t> number_in(const std::string &pattern, const std::string &name) {
    size_t begin, end, digits;
    if (!find_number(pattern, begin, end, digits)) return std::nullopt;
    const size_t behind = pattern.size() - end;
    if (name.size() < begin + behind) return std::nullopt;
    const auto number = to_integer(std::string_view(name).substr(begin, name.size() - begin - behind));
    if (!number || numbered(pattern, *number) != name) return std::nullopt;
    return number;
}

} // namespace wisp
