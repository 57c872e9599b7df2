// tools/run_tests adds up what its processes say, and counts as failed what a crash keeps from running.
#include "support/temporary_folder.h"
#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace {

// What tools/run_tests prints of the 15 cases of a test program that pass a filter; its exit status.
int run_tests(const std::string &last_process, std::string &printed) {
    const wisp::TemporaryFolder folder;
    const std::string program = folder.file("tests"), out = folder.file("out");
    std::ofstream(program)
        << "#!/bin/sh\ncase $1$2 in\n"
           "-ts=long--count) echo '[doctest] unskipped test cases passing the current filters: 15' ;;\n"
           "-ts=long--first=15) "
        << last_process
        << " ;;\n"
           "-ts=long--first=5) echo 'skipped: a case: there is no file' && echo '0 passed, 0 failed, 1 skipped' ;;\n"
           "-ts=long*) echo '1 passed, 0 failed' ;;\nesac\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    const int status = std::system(("tools/run_tests " + program + " -ts=long > " + out).c_str());
    std::ifstream file(out);
    printed.assign(std::istreambuf_iterator<char>(file), {});
    return status;
}

} // namespace

TEST_CASE("run_tests counts what passed, failed and was skipped") {
    std::string printed;
    CHECK(run_tests("echo '1 passed, 0 failed'", printed) == 0);
    CHECK(printed == "skipped: a case: there is no file\n14 passed, 0 failed, 1 skipped\n");
    CHECK(run_tests("echo 'a.cpp:1: wrong' && echo '0 passed, 1 failed' && exit 1", printed) != 0);
    CHECK(printed ==
          "a.cpp:1: wrong\n0 passed, 1 failed\nskipped: a case: there is no file\n13 passed, 1 failed, 1 skipped\n");
    CHECK(run_tests("exit 139", printed) != 0); // a crash
    CHECK(printed == "skipped: a case: there is no file\n13 passed, 1 failed, 1 skipped\n");
}
