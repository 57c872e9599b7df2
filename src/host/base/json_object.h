// Writing JSON.
#pragma once
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>

namespace wisp {

// `"name": value` pairs in braces.
class Object {
  public:
    Object &add(const char *name, const std::string &value) {
        text_ += (text_.empty() ? "\"" : ", \"") + std::string(name) + "\": " + value;
        return *this;
    }
    Object &add(const char *name, uint64_t value) { return add(name, std::to_string(value)); }
    Object &add(const char *name, double value) {
        char digits[40];
        std::snprintf(digits, sizeof digits, "%.6f", value);
        return add(name, std::string(digits));
    }
    Object &add(const char *name, const Object &value) { return add(name, value.text()); }
    Object &add_flag(const char *name, bool value) { return add(name, std::string(value ? "true" : "false")); }
    std::string text() const { return "{ " + text_ + " }"; }

  private:
    std::string text_;
};

inline std::string quoted(const std::string &text) {
    std::string quote = "\"";
    for (const char c : text) {
        char code[8];
        std::snprintf(code, sizeof code, "\\u%04x", static_cast<unsigned char>(c));
        if (c == '"' || c == '\\')
            quote += '\\', quote += c;
        else if (static_cast<unsigned char>(c) < ' ')
            quote += code;
        else
            quote += c;
    }
    return quote + '"';
}

// The shortest digits that read back as the same number.
inline std::string exact(double x) {
    if (!std::isfinite(x)) return "null";
    char digits[40];
    return std::string(digits, std::to_chars(digits, digits + sizeof digits, x).ptr);
}

} // namespace wisp
