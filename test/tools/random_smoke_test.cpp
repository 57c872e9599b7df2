// tools/measure/random_smoke.py passes a scene that is right, and finds what is wrong in a program that is not.
#include "support/command_line.h"

namespace {

wisp::Ran random_smoke(const wisp::CommandLineTest &folder, const std::string &program) {
    const std::string command = "python3 tools/measure/random_smoke.py --scene 36 --wisp " + program + " > " +
                                folder.file("out") + " 2> " + folder.file("err");
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, wisp::text_of(folder.file("out")),
            wisp::text_of(folder.file("err"))};
}

} // namespace

TEST_CASE("random smoke passes what is right" * doctest::test_suite("long")) {
    const wisp::CommandLineTest folder;
    std::filesystem::create_symlink(std::filesystem::absolute(wisp::built("wisp")), folder.file("wisp"));
    const wisp::Ran ran = random_smoke(folder, folder.file("wisp"));
    CHECK_MESSAGE(ran.status == 0, ran.out, ran.err);
    CHECK(ran.out.find("0 faults in 0 of 1 scenes") != std::string::npos);
}

TEST_CASE("random smoke finds light that is lost, and a crash" * doctest::test_suite("long")) {
    wisp::CommandLineTest folder;
    // Without photons nothing is scattered twice.
    folder.write("wisp", "#!/bin/sh\ncase \"$*\" in *'--arith fixed'*) exit 139; esac\nexec " +
                             std::filesystem::absolute(wisp::built("wisp")).string() +
                             " $(echo \"$*\" | sed 's/--photons 12288/--photons 0/')\n");
    std::filesystem::permissions(folder.file("wisp"), std::filesystem::perms::owner_all);
    const wisp::Ran ran = random_smoke(folder, folder.file("wisp"));
    CHECK(ran.status == 1);
    CHECK(ran.out.find("crash: --seed 1 --scene 36: default, fixed: status 139") != std::string::npos);
    CHECK(ran.out.find("deviates: --seed 1 --scene 36: default, f32") != std::string::npos);
}
