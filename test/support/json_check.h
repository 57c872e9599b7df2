// Whether a text is JSON.
#pragma once
#include "host/base/text.h"
#include <algorithm>
#include <string>
#include <string_view>

namespace wisp {

// Numbers are finite and as to_number reads them.
class JsonCheck {
  public:
    explicit JsonCheck(const std::string &text) : text_(text) {}
    // The text is one value and nothing else.
    bool whole() {
        if (!value()) return false;
        space();
        return at_ == text_.size();
    }
    size_t numbers = 0;

  private:
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
            if (text_[at_] == '\\' && std::string_view("\"\\/bfnrtu").find(text_[++at_]) == std::string_view::npos)
                return false;
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
        const size_t end = text_.find_first_of(",]} \n", at_);
        if (end == std::string::npos || !to_number(std::string_view(text_).substr(at_, end - at_))) return false;
        at_ = end;
        ++numbers;
        return true;
    }

    const std::string &text_;
    size_t at_ = 0;
};

} // namespace wisp
