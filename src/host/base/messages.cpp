#include "host/base/messages.h"
#include "host/base/text.h"
#include <cstdio>

namespace wisp {

namespace {

void print(const std::string &place, const char *severity, const std::string &text) {
    print_note(place + ": " + severity + ": " + text);
}

} // namespace

void print_note(const std::string &text) { std::fprintf(stderr, "%s\n", printable(text).c_str()); }

void print_error(const Error &error, const std::string &program) {
    print(error.place.empty() ? program : error.place, "error", error.text);
}

void Warnings::print(const Warning &warning) {
    if (quiet_ || !said_.insert(warning.kind).second) return;
    wisp::print(warning.place.empty() ? "wisp" : warning.place, "warning", warning.text);
}

} // namespace wisp
