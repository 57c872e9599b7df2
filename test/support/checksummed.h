// Files that begin with the SHA-256 of the rest: made with any text, and damaged.
#pragma once
#include "host/base/files.h"
#include "host/base/sha256.h"
#include <doctest/doctest.h>

inline wisp::Bytes bytes_of(const std::string &text) { return wisp::Bytes(text.begin(), text.end()); }
inline std::string text_of(const wisp::Bytes &bytes) { return std::string(bytes.begin(), bytes.end()); }

// A file whose SHA-256 is right, whatever it says of itself. `kind` is its first line.
inline std::string checksummed(const std::string &kind, const std::string &rest) {
    return kind + "\nsha256 " + wisp::sha256(rest.data(), rest.size()).text + "\n" + rest;
}

// A bit that changed anywhere, a cut anywhere, and a byte more are refused: error_of(file) is not "no error".
template <class ErrorOf> void check_damage_is_refused(const std::string &file, ErrorOf &&error_of) {
    for (size_t i = 0; i < file.size(); ++i) {
        CAPTURE(i);
        for (int bit = 0; bit < 8; ++bit) {
            std::string damaged = file;
            damaged[i] = static_cast<char>(damaged[i] ^ 1 << bit);
            CHECK(error_of(damaged) != "no error");
        }
        CHECK(error_of(file.substr(0, i)) != "no error");
    }
    CHECK(error_of(file + '\0') != "no error");
    CHECK(error_of(file + "\n") != "no error");
}
