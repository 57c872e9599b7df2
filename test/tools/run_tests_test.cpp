// tools/run_tests adds up what its processes say, and counts as failed what a crash keeps from running.
#include "support/temporary_folder.h"
#include <cstdlib>
#include <doctest/doctest.h>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace {

// What tools/run_tests prints of a test program of 15 cases, three processes of 6; its exit status.
int run_tests(const std::string &last_process, std::string &printed) {
    const wisp::TemporaryFolder folder;
    const std::string program = folder.file("tests"), out = folder.file("out");
    std::ofstream(program)
        << "#!/bin/sh\ncase $1 in\n"
           "--count) echo '[doctest] unskipped test cases passing the current filters: 15' ;;\n"
           "--first=1) echo '6 passed, 0 failed' ;;\n"
           "--first=7) echo 'skipped: a case: there is no file' && echo '4 passed, 0 failed, 2 skipped' ;;\n"
           "*) "
        << last_process << " ;;\nesac\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    const int status = std::system(("tools/run_tests " + program + " > " + out).c_str());
    std::ifstream file(out);
    printed.assign(std::istreambuf_iterator<char>(file), {});
    return status;
}

} // namespace

TEST_CASE("run_tests counts what passed, failed and was skipped") {
    std::string printed;
    CHECK(run_tests("echo '3 passed, 0 failed'", printed) == 0);
    CHECK(printed == "skipped: a case: there is no file\n13 passed, 0 failed, 2 skipped\n");
    CHECK(run_tests("echo 'a.cpp:1: wrong' && echo '2 passed, 1 failed' && exit 1", printed) != 0);
    CHECK(printed ==
          "a.cpp:1: wrong\n2 passed, 1 failed\nskipped: a case: there is no file\n12 passed, 1 failed, 2 skipped\n");
    CHECK(run_tests("exit 139", printed) != 0); // a crash
    CHECK(printed == "skipped: a case: there is no file\n10 passed, 3 failed, 2 skipped\n");
}
