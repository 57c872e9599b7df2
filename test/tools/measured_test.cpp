// tools/measure/measured.py: README's figures are those of fixtures/measured; a table is taken with its origin or not
// at all; and the report shows a release until something newer was measured here.
#include "support/command_line.h"
#include "support/data.h"

namespace {

using namespace wisp;

const std::string header = "method,s,spread %,RMSE,noise\n", rows = "default,9.87,1.2,0.0094,-\n"
                                                                    "direct,104.66,2,0.1014,-\n"
                                                                    "reference,5.91,3,-,0.0552\n"
                                                                    "more of it,1477,-,-,0.00304\n";
const std::string table =
    "| method | error | seconds |\n| --- | --- | --- |\n"
    "| default | 0.94 % | 9.87 |\n"
    "| direct | 10 % | 105 |\n"
    "| `--max-error E` | E at most: wisp chooses photons and cells | as chosen, and ten frames or more to "
    "choose |\n"
    "| reference | no bias; noise 5.5 % | 5.91 |\n"
    "| more of it | no bias; noise 0.3 % | about 1,500 |\n";

std::string origin(const std::string &when, const std::string &commit, const std::string &quick = "false") {
    return "{\"methods\": {\"title\": \"t\", \"notes\": \"\", \"machine\": {\"when\": \"" + when +
           "\", \"commit\": \"" + commit + "\", \"quick\": " + quick + "}}}\n";
}

struct MeasuredTest : CommandLineTest {
    MeasuredTest() {
        for (const char *folder : {"bench", "measured"}) std::filesystem::create_directory(file(folder));
        write("README.md", "# a\n\n| method | error | seconds |\n| --- | --- | --- |\n| old | 1 % | 2 |\n\nb\n");
        write("bench/methods.csv", header + rows);
        write("bench/tables.json", origin("2026-01-02T03:04+00:00", "0123456789ab"));
    }
    Ran measured(const std::string &words) const {
        return run("python3 tools/measure/measured.py " + words + " --bench " + file("bench") + " --measured " +
                   file("measured") + " --readme " + file("README.md"));
    }
};

} // namespace

TEST_CASE("README's figures are those of the tables of the release") {
    const CommandLineTest test;
    const Ran ran = test.run("python3 tools/measure/measured.py check");
    CHECK_MESSAGE(ran.status == 0, ran.out, ran.err);
    if (ran.out.find("nothing to hold") == 0) skip_case(ran.out);
}

TEST_CASE_FIXTURE(MeasuredTest,
                  "measured: tables are taken, README is written by them, and any other figure is found") {
    CHECK(measured("check").out.find("nothing to hold") == 0);
    const Ran taken = measured("");
    CHECK_MESSAGE(taken.status == 0, taken.out, taken.err);
    CHECK(text_of(file("README.md")) == "# a\n\n" + table + "\nb\n");
    CHECK(text_of(file("measured/methods.csv")) == header + rows);
    CHECK(text_of(file("measured/tables.json")).find("0123456789ab") != std::string::npos);
    CHECK(measured("check").status == 0);

    std::string wrong = text_of(file("README.md"));
    wrong.replace(wrong.find("9.87"), 4, "9.86");
    write("README.md", wrong);
    const Ran found = measured("check");
    CHECK(found.status == 1);
    CHECK(found.out.find("-| default | 0.94 % | 9.86 |\n+| default | 0.94 % | 9.87 |\n") != std::string::npos);
    CHECK(text_of(file("README.md")) == wrong); // a check writes nothing
    write("README.md", "# a\n");
    CHECK(measured("check").status == 1);
}

TEST_CASE_FIXTURE(MeasuredTest, "measured: tables of a QUICK run, of no known commit or without errors are refused") {
    const std::string readme = text_of(file("README.md"));
    const struct {
        std::string index, error;
    } refused[] = {{origin("2026-01-02", "0123456789ab", "true"), "methods is of a QUICK run"},
                   {origin("2026-01-02", "0123456789ab with changes"), "expected a commit as it is in git"},
                   {origin("2026-01-02", "unknown"), "expected a commit as it is in git"},
                   {"{}\n", "has no tables"}};
    for (const auto &what : refused) {
        write("bench/tables.json", what.index);
        const Ran ran = measured("");
        CHECK(ran.status == 1);
        CHECK_MESSAGE(ran.err.find(what.error) != std::string::npos, ran.err);
        CHECK(!std::filesystem::exists(file("measured/methods.csv")));
    }
    write("bench/tables.json", origin("2026-01-02", "0123456789ab"));
    write("bench/methods.csv", header + "default,9.87,1.2,-,-\n");
    const Ran ran = measured("");
    CHECK(ran.status == 1);
    CHECK_MESSAGE(ran.err.find("'default' has no error") != std::string::npos, ran.err);
    CHECK(text_of(file("README.md")) == readme);
}

TEST_CASE_FIXTURE(MeasuredTest,
                  "measured: the report shows the release's table until something newer was measured here") {
    write("measured/methods.csv", header + "of the release,1,1,1,1\n");
    const auto shown = [&] {
        const Ran ran =
            run("python3 -c \"import sys; sys.path.insert(0, 'tools/measure/report'); from pathlib import Path; "
                "import tables; table = tables.read(Path('" +
                file("bench") + "'), Path('" + file("measured") +
                "'))['methods']; print(table.released, table.rows[0][0])\"");
        REQUIRE_MESSAGE(ran.status == 0, ran.err);
        return ran.out;
    };
    CHECK(shown() == "False default\n"); // there is no release
    write("measured/tables.json", origin("2026-01-03T00:00+00:00", "ffffffffffff"));
    CHECK(shown() == "True of the release\n");
    write("measured/tables.json", origin("2026-01-01T00:00+00:00", "ffffffffffff"));
    CHECK(shown() == "False default\n");
    write("bench/tables.json", "{}\n");
    std::filesystem::remove(file("bench/methods.csv"));
    CHECK(shown() == "True of the release\n");
}
