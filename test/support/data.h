// Files of others that some tests read: scenes, particles, published values. A test case without its file is skipped,
// which is counted.
#pragma once
#include <filesystem>
#include <string>

namespace wisp {

// A file or folder of the data: below $WISP_DATA or, where that is not set, below the Makefile's DATA.
std::string data_path(const std::string &name);

// Counts the test case that runs as skipped, where no check of it fails, and says why. It may go on.
void skip_case(const std::string &why);

// Whether AddressSanitizer is in the tests: it maps more than a limit on addresses allows, calls functions that the
// core does not, and programs that are compiled without it cannot link what has it.
#ifdef __SANITIZE_ADDRESS__
constexpr bool has_address_sanitizer = true;
#else
constexpr bool has_address_sanitizer = false;
#endif

} // namespace wisp

// Ends the test case as skipped where the data have no such file or folder.
#define WISP_NEEDS_DATA(name)                                                                                          \
    if (!std::filesystem::exists(wisp::data_path(name))) return wisp::skip_case("there is no " + wisp::data_path(name))
