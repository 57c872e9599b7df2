// Whether a text is JSON.
#pragma once
#include <algorithm>
#include <clocale>
#include <cstdlib>
#include <doctest/doctest.h>
#include <regex>
#include <string>
#include <string_view>

namespace wisp {

// By RFC 8259, but for white space: blanks and line ends alone.
class JsonCheck {
  public:
    explicit JsonCheck(const std::string &text) : text_(text) {}
    // The text is one value and nothing else.
    bool whole() {
        if (!is_utf8() || !value()) return false;
        space();
        return at_ == text_.size();
    }
    size_t numbers = 0;

  private:
    bool is_utf8() const {
        REQUIRE(std::setlocale(LC_CTYPE, "C.UTF-8"));
        const bool valid = std::mbstowcs(nullptr, text_.c_str(), 0) != static_cast<size_t>(-1);
        std::setlocale(LC_CTYPE, "C");
        return valid;
    }
    void space() { at_ = std::min(text_.find_first_not_of(" \n", at_), text_.size()); }
    bool take(const std::string &word) {
        space();
        if (text_.compare(at_, word.size(), word) != 0) return false;
        at_ += word.size();
        return true;
    }
    bool string() {
        if (!take("\"")) return false;
        for (; at_ < text_.size() && text_[at_] != '"'; ++at_) {
            if (static_cast<unsigned char>(text_[at_]) < ' ') return false;
            if (text_[at_] != '\\') continue;
            if (text_[++at_] == 'u') {
                for (int digit = 0; digit < 4; ++digit)
                    if (std::string_view("0123456789abcdefABCDEF").find(text_[++at_]) == std::string_view::npos)
                        return false;
            } else if (std::string_view("\"\\/bfnrt").find(text_[at_]) == std::string_view::npos) {
                return false;
            }
        }
        return take("\"");
    }
    bool list(const char *end, bool named) {
        if (take(end)) return true;
        do {
            if (named && (!string() || !take(":"))) return false;
            if (!value()) return false;
        } while (take(","));
        return take(end);
    }
    bool value() {
        if (take("{")) return list("}", true);
        if (take("[")) return list("]", false);
        if (take("null") || take("true") || take("false")) return true;
        space();
        if (text_[at_] == '"') return string();
        static const std::regex number("-?(0|[1-9][0-9]*)([.][0-9]+)?([eE][-+]?[0-9]+)?");
        const size_t end = std::min(text_.find_first_of(",]} \n", at_), text_.size());
        if (!std::regex_match(text_.substr(at_, end - at_), number)) return false;
        at_ = end;
        ++numbers;
        return true;
    }

    const std::string &text_;
    size_t at_ = 0;
};

} // namespace wisp
