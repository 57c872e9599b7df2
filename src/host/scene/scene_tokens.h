// The words of a scene file and of those that it includes, and the elements of statements: names, numbers, vectors,
// colours. Every file is read and split into words once, however often it is included.
//
// Errors are InputErrors at the line of the word that was taken last.
#pragma once
#include "host/base/files.h"
#include "wisp/scene.h"
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace wisp {

// Limits, because a scene may include files again and again.
struct SceneLimits {
    size_t depth = 64;              // of files in files
    size_t includes = 100000;       // in all
    size_t words = size_t{1} << 26; // of all includes, a file counts each time
    size_t bytes = size_t{1} << 30; // of all files
    size_t triangles = size_t{1} << 26;
};

using FileReader = std::function<Bytes(const std::string &path)>; // throws InputError

// The name of a file or of a grid as a scene has it: in double quotes where it would not be one word without them.
// nullopt: it is none with them either.
std::optional<std::string> name_word(const std::string &name);

class SceneTokens {
  public:
    SceneTokens(const std::string &path, const std::string &text, const FileReader &read, const SceneLimits &limits);

    // The file that is being read: 0 is the outermost.
    size_t depth() const { return open_.size() - 1; }
    bool at_end() const { return open_.back().next == open_.back().source->words.size(); }
    void include(const std::string &path); // its words come next
    void leave();                          // returns from an included file to the one that includes it
    // The path of a file whose name in the current file is `file`.
    std::string beside(std::string_view file) const;

    int line() const;
    std::string where() const; // `FILE:LINE`
    [[noreturn]] void fail(const std::string &text) const;

    // The next word. An error says that `part` and `what`, joined, was expected. The text is valid as long as this
    // object.
    std::string_view take(std::string_view what, std::string_view part = "");
    std::string name(std::string_view what); // any word but a brace
    void keyword(std::string_view word);
    bool accept(std::string_view word); // takes the next word if it is this one
    bool next_is_number() const;
    double number(std::string_view what, std::string_view part = "");
    double number_in(std::string_view what, double low, double high, std::string_view part = "");
    int64_t integer(std::string_view what, int64_t low, int64_t high);
    // How many of something come next; there are at least `words_each` words for each of them.
    size_t count(std::string_view what, int64_t low, size_t words_each);
    Double3 vector(std::string_view what);
    Double3 direction(std::string_view what); // not 0 0 0
    Double3 color(std::string_view what, double high = 1e30);
    std::string last() const; // the word that was taken last

  private:
    struct Word {
        std::string_view text;
        int line;
    };
    struct Source {
        std::string path, text;
        std::vector<Word> words;
    };
    struct Open {
        const Source *source;
        size_t next; // word
    };
    void add(Source &source, const std::string &path, std::string text);

    FileReader read_;
    SceneLimits limits_;
    std::map<std::string, Source> sources_; // by path
    std::vector<Open> open_;                // each included by the one before
    size_t includes_ = 0, included_words_ = 0, bytes_ = 0;
};

} // namespace wisp
