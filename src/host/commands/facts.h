// What is known of something: names and values in order, as lines for people and as a JSON object.
#pragma once
#include "host/base/json_object.h"
#include "wisp/scene.h"
#include <algorithm>
#include <initializer_list>
#include <limits>
#include <vector>

namespace wisp {

// The range of some numbers. NaN and infinities are counted alone.
class Spread {
  public:
    void add(double x, uint64_t times = 1);
    uint64_t nans() const { return nans_; }
    uint64_t infinities() const { return infinities_; }
    bool any() const { return finite_ > 0; }
    double low() const { return low_; }
    double high() const { return high_; }
    double mean() const { return std::clamp(sum_ / static_cast<double>(finite_), low_, high_); } // sums round

  private:
    uint64_t finite_ = 0, nans_ = 0, infinities_ = 0;
    double low_ = std::numeric_limits<double>::infinity(), high_ = -low_, sum_ = 0;
};

// Names are keys of the JSON object; lines have blanks for their underlines. Lines give numbers to six digits, JSON
// gives all that they have.
class Facts {
  public:
    Facts &word(const char *name, const std::string &value);
    Facts &words(const char *name, const std::vector<std::string> &values); // an array
    Facts &count(const char *name, uint64_t value);
    Facts &number(const char *name, double value);
    Facts &point(const char *name, const Double3 &value);
    // An array; lines have the separator between its numbers.
    Facts &integers(const char *name, std::initializer_list<int64_t> values, const char *separator = " x ");
    Facts &flag(const char *name, bool value);
    Facts &spread(const char *name, const Spread &value);
    Facts &none(const char *name, const std::string &why); // null, and why
    Facts &group(const char *name, const Facts &facts);
    Facts &list(const char *name, const char *item, const std::vector<Facts> &items); // lines: `ITEM 1`, `ITEM 2` ...
    // A value as a line has it, and as JSON.
    Facts &add(const char *name, const std::string &text, const std::string &json);

    std::string text() const { return text_; }
    std::string json() const { return object_.text(); }

  private:
    void line(const std::string &label, const std::string &text);
    void inner(const std::string &label, const Facts &facts);

    std::string text_; // whole lines
    Object object_;
};

} // namespace wisp
