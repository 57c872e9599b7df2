#include "host/base/error.h"
#include "host/base/text.h"
#include "host/scene/scene_tokens.h"
#include <cmath>

namespace wisp {

namespace {

std::string joined(std::string_view a, std::string_view b) { return std::string(a).append(b); }

bool is_space(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v' || c == '\n'; }

// Whether `%d` or `%04d` stands there.
bool is_frame_number(const std::string &text, size_t i) {
    for (++i; i < text.size() && text[i] >= '0' && text[i] <= '9';) ++i;
    return i < text.size() && text[i] == 'd';
}

} // namespace

std::optional<std::string> name_word(const std::string &name) {
    if (name.empty() || name.find_first_of("\"\n") != std::string::npos) return std::nullopt;
    for (size_t i = 0; i < name.size(); ++i)
        if (is_space(name[i]) || name[i] == '{' || name[i] == '}' || name[i] == '#' ||
            (name[i] == '%' && !is_frame_number(name, i)))
            return "\"" + name + "\"";
    return name;
}

SceneTokens::SceneTokens(const std::string &path, const std::string &text, const FileReader &read,
                         const SceneLimits &limits)
    : read_(read), limits_(limits) {
    Source &source = sources_[path];
    add(source, path, text);
    open_.push_back({&source, 0});
}

// Words between white space; `{` and `}` are words of their own. `#` and `%` start a comment, but for `%04d` in the
// name behind `smoke`. A word in double quotes may hold any of these.
void SceneTokens::add(Source &source, const std::string &path, std::string text) {
    source.path = path;
    source.text = std::move(text);
    bytes_ += source.text.size();
    const std::string &s = source.text;
    int line = 1;
    for (size_t i = 0; i < s.size();) {
        const size_t begin = i;
        const bool pattern = !source.words.empty() && source.words.back().text == "smoke";
        const auto is_comment = [&] { return s[i] == '#' || (s[i] == '%' && !(pattern && is_frame_number(s, i))); };
        if (is_space(s[i])) {
            if (s[i++] == '\n') ++line;
        } else if (is_comment()) {
            while (i < s.size() && s[i] != '\n') ++i;
        } else if (s[i] == '"') {
            const size_t end = s.find_first_of("\"\n", i + 1);
            if (end == std::string::npos || s[end] == '\n' || end == begin + 1)
                throw InputError(path + ":" + std::to_string(line),
                                 end == begin + 1 ? "an empty name in quotes, expected a name"
                                                  : "the line ends in a name in quotes, expected '\"' behind the name");
            source.words.push_back({std::string_view(s).substr(begin + 1, end - begin - 1), line});
            i = end + 1;
        } else {
            const bool brace = s[i] == '{' || s[i] == '}';
            ++i;
            while (!brace && i < s.size() && !is_space(s[i]) && s[i] != '{' && s[i] != '}' && !is_comment()) ++i;
            source.words.push_back({std::string_view(s).substr(begin, i - begin), line});
        }
    }
}

void SceneTokens::include(const std::string &path) {
    const auto limit = [this](size_t found, size_t most, const std::string &what) {
        if (found > most) fail("more than " + std::to_string(most) + " " + what + ", expected no more");
    };
    for (const Open &open : open_)
        if (open.source->path == path) fail("'" + path + "' includes itself, expected no circle of includes");
    limit(open_.size(), limits_.depth, "files in one another");
    limit(++includes_, limits_.includes, "included files");
    const auto [found, is_new] = sources_.try_emplace(path);
    Source &source = found->second;
    if (is_new) {
        Bytes bytes;
        try {
            bytes = read_(path);
        } catch (const InputError &error) {
            fail(std::string("include of ") + error.what());
        }
        limit(bytes_ + bytes.size(), limits_.bytes, "bytes in all files of a scene");
        add(source, path, std::string(bytes.begin(), bytes.end()));
    }
    included_words_ += source.words.size();
    limit(included_words_, limits_.words, "words in included files");
    open_.push_back({&source, 0});
}

void SceneTokens::leave() { open_.pop_back(); }

std::string SceneTokens::beside(std::string_view file) const {
    const std::string &path = open_.back().source->path;
    const size_t slash = path.rfind('/');
    return joined(file[0] == '/' || slash == std::string::npos ? "" : path.substr(0, slash + 1), file);
}

int SceneTokens::line() const {
    const auto &[source, next] = open_.back();
    return source->words.empty() ? 1 : source->words[next > 0 ? next - 1 : 0].line;
}
std::string SceneTokens::where() const { return open_.back().source->path + ":" + std::to_string(line()); }
void SceneTokens::fail(const std::string &text) const { throw InputError(where(), text); }
std::string SceneTokens::last() const {
    const auto &[source, next] = open_.back();
    return std::string(source->words[next - 1].text);
}

std::string_view SceneTokens::take(std::string_view what, std::string_view part) {
    if (at_end()) fail("the file ends, expected " + joined(part, what));
    Open &open = open_.back();
    return open.source->words[open.next++].text;
}

std::string SceneTokens::name(std::string_view what) {
    const std::string_view word = take(what);
    if (word == "{" || word == "}") fail("found '" + last() + "', expected " + std::string(what));
    return std::string(word);
}

void SceneTokens::keyword(std::string_view word) {
    const std::string expected = joined("'", word) + "'";
    if (take(expected) != word) fail("found '" + last() + "', expected " + expected);
}

bool SceneTokens::accept(std::string_view word) {
    Open &open = open_.back();
    const bool found = !at_end() && open.source->words[open.next].text == word;
    if (found) ++open.next;
    return found;
}

bool SceneTokens::next_is_number() const {
    const auto &[source, next] = open_.back();
    return !at_end() && to_number(source->words[next].text);
}

double SceneTokens::number(std::string_view what, std::string_view part) {
    const auto value = to_number(take(what, part));
    if (!value) fail("found '" + last() + "', expected a number: " + joined(part, what));
    if (std::fabs(*value) > 1e30)
        fail("found '" + last() + "', expected a number within +-1e30: " + joined(part, what));
    return *value;
}

double SceneTokens::number_in(std::string_view what, double low, double high, std::string_view part) {
    const double value = number(what, part);
    if (!(value >= low && value <= high)) fail("found " + last() + ", expected " + joined(part, what));
    return value;
}

int64_t SceneTokens::integer(std::string_view what, int64_t low, int64_t high) {
    const auto value = to_integer(take(what));
    if (!value || *value < low || *value > high)
        fail("found '" + last() + "', expected a whole number from " + std::to_string(low) + " to " +
             std::to_string(high) + ": " + std::string(what));
    return *value;
}

size_t SceneTokens::count(std::string_view what, int64_t low, size_t words_each) {
    const auto n = static_cast<size_t>(integer(what, low, INT32_MAX));
    const size_t left = open_.back().source->words.size() - open_.back().next;
    if (n > left / words_each)
        fail("found '" + last() + "', but the file has only " + std::to_string(left) + " words more, expected " +
             std::to_string(words_each) + " for each: " + std::string(what));
    return n;
}

Double3 SceneTokens::vector(std::string_view what) {
    Double3 v;
    v.x = number(what, "x of ");
    v.y = number(what, "y of ");
    v.z = number(what, "z of ");
    return v;
}

Double3 SceneTokens::direction(std::string_view what) {
    const Double3 v = vector(what);
    if (v.x == 0 && v.y == 0 && v.z == 0) fail("found 0 0 0, expected " + joined(what, " of some length"));
    return v;
}

Double3 SceneTokens::color(std::string_view what, double high) {
    const bool part = high == 1;
    Double3 c;
    c.x = number_in(what, 0, high, part ? "red from 0 to 1 of " : "red of 0 or more of ");
    c.y = number_in(what, 0, high, part ? "green from 0 to 1 of " : "green of 0 or more of ");
    c.z = number_in(what, 0, high, part ? "blue from 0 to 1 of " : "blue of 0 or more of ");
    return c;
}

} // namespace wisp
