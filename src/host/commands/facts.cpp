#include "host/base/text.h"
#include "host/commands/facts.h"

namespace wisp {

namespace {

std::string label_of(const char *name) {
    std::string label = name;
    std::replace(label.begin(), label.end(), '_', ' ');
    return label;
}

} // namespace

void Spread::add(double x, uint64_t times) {
    if (std::isnan(x)) {
        nans_ += times;
    } else if (std::isinf(x)) {
        infinities_ += times;
    } else {
        finite_ += times;
        low_ = std::min(low_, x);
        high_ = std::max(high_, x);
        sum_ += x * static_cast<double>(times);
    }
}

void Facts::line(const std::string &label, const std::string &text) {
    constexpr size_t width = 18;
    text_ += label + std::string(label.size() < width ? width - label.size() : 1, ' ') + printable(text) + "\n";
}

void Facts::inner(const std::string &label, const Facts &facts) {
    text_ += label + "\n";
    for (const std::string &line : split(facts.text_, '\n'))
        if (!line.empty()) text_ += "  " + line + "\n";
}

Facts &Facts::add(const char *name, const std::string &text, const std::string &json) {
    line(label_of(name), text);
    object_.add(name, json);
    return *this;
}

// JSON has no bytes that are not UTF-8.
Facts &Facts::word(const char *name, const std::string &value) { return add(name, value, quoted(printable(value))); }

Facts &Facts::words(const char *name, const std::vector<std::string> &values) {
    std::string text, json;
    for (size_t i = 0; i < values.size(); ++i) {
        text += (i ? ", " : "") + values[i];
        json += (i ? ", " : "") + quoted(printable(values[i]));
    }
    return add(name, text, "[" + json + "]");
}

Facts &Facts::count(const char *name, uint64_t value) {
    const std::string digits = std::to_string(value);
    return add(name, digits, digits);
}

Facts &Facts::number(const char *name, double value) { return add(name, six_digits(value), exact(value)); }

Facts &Facts::point(const char *name, const Double3 &value) {
    return add(name, six_digits(value.x) + " " + six_digits(value.y) + " " + six_digits(value.z),
               "[" + exact(value.x) + ", " + exact(value.y) + ", " + exact(value.z) + "]");
}

Facts &Facts::integers(const char *name, std::initializer_list<int64_t> values, const char *separator) {
    std::string text, json;
    for (const int64_t value : values) {
        text += (text.empty() ? "" : separator) + std::to_string(value);
        json += (json.empty() ? "" : ", ") + std::to_string(value);
    }
    return add(name, text, "[" + json + "]");
}

Facts &Facts::flag(const char *name, bool value) { return add(name, value ? "yes" : "no", value ? "true" : "false"); }

Facts &Facts::spread(const char *name, const Spread &value) {
    if (!value.any()) return none(name, "there is no finite number");
    return add(name, six_digits(value.low()) + " to " + six_digits(value.high()) + ", mean " + six_digits(value.mean()),
               Object()
                   .add("low", exact(value.low()))
                   .add("high", exact(value.high()))
                   .add("mean", exact(value.mean()))
                   .text());
}

Facts &Facts::none(const char *name, const std::string &why) { return add(name, "none: " + why, "null"); }

Facts &Facts::group(const char *name, const Facts &facts) {
    inner(label_of(name), facts);
    object_.add(name, facts.json());
    return *this;
}

Facts &Facts::list(const char *name, const char *item, const std::vector<Facts> &items) {
    std::string json;
    for (size_t i = 0; i < items.size(); ++i) {
        inner(std::string(item) + " " + std::to_string(i + 1), items[i]);
        json += (i ? ",\n    " : "\n    ") + items[i].json();
    }
    object_.add(name, "[" + json + " ]");
    return *this;
}

} // namespace wisp
