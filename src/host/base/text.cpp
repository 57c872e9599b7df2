#include "host/base/text.h"
#include <charconv>
#include <cmath>
#include <cstdlib>

namespace wisp {

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

} // namespace wisp
