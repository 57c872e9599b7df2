// tools/faults: wisp survives a little of what `make faults` does to it; and what a worse program does is found.
#include "support/command_line.h"

namespace {

// `program` instead of wisp, disturbed in some ways.
wisp::Ran faults(const wisp::CommandLineTest &folder, const std::string &words) {
    const std::string library = std::filesystem::absolute(wisp::built("faults.so")).string();
    std::filesystem::create_symlink(library, folder.file("faults.so"));
    return folder.run("python3 tools/faults -j 1 --build " + folder.file("") + " " + words);
}

} // namespace

TEST_CASE("faults: without memory, with short reads and writes, and beside itself wisp leaves nothing that is wrong") {
    if (wisp::has_address_sanitizer)
        return wisp::skip_case("AddressSanitizer must be loaded before what makes calls fail");
    const wisp::CommandLineTest folder;
    std::filesystem::create_symlink(std::filesystem::absolute(wisp::built("wisp")), folder.file("wisp"));
    const wisp::Ran ran = faults(folder, "--most 10 memory short two --command sequence");
    CHECK_MESSAGE(ran.status == 0, ran.out, ran.err);
    CHECK(ran.out.find("requests for memory that fail") != std::string::npos);
    CHECK(ran.out.find("\n0 faults\n") != std::string::npos);
}

TEST_CASE("faults: what is left, changed, of another status or no line of error is found") {
    if (wisp::has_address_sanitizer)
        return wisp::skip_case("AddressSanitizer must be loaded before what makes calls fail");
    wisp::CommandLineTest folder;
    const std::string wisp = std::filesystem::absolute(wisp::built("wisp")).string();
    folder.write("wisp", "#!/bin/sh\n" + wisp +
                             " \"$@\"\nstatus=$?\n"
                             "case \"$FAULT_CLOCK\" in\n"
                             "-1000000000) touch a.png.part ;;\n"
                             "-1) echo more >> a.png ;;\n"
                             "1000000000) echo one; exit 5 ;;\n"
                             "esac\nexit $status\n");
    std::filesystem::permissions(folder.file("wisp"), std::filesystem::perms::owner_all);
    const wisp::Ran ran = faults(folder, "clock --command stitch");
    CHECK(ran.status == 1);
    for (const std::string found :
         {"stitch: FAULT_CLOCK=-1000000000: a.png.part is left",
          "stitch: FAULT_CLOCK=-1: a.png is wrong though the status is 0",
          "stitch: FAULT_CLOCK=1000000000: status 5, expected one of [0]",
          "stitch: FAULT_CLOCK=1000000000: standard error is '', expected one line", "\n5 faults\n"}) {
        CAPTURE(found);
        CHECK_MESSAGE(ran.out.find(found) != std::string::npos, ran.out);
    }
}
