// Runs every test. The last line says how many test cases passed and failed and, where there are some, were skipped.
#define DOCTEST_CONFIG_IMPLEMENT
#include "support/built.h"
#include "support/data.h"
#include <cstdio>
#include <cstdlib>
#include <doctest/doctest.h>
#include <malloc.h>
#include <stdexcept>

namespace {

unsigned cases_run = 0, cases_failed = 0, cases_skipped = 0;
const char *running = "";      // the test case
bool skips = false;            // the running test case
std::string build_folder = ""; // of this program

struct Counter : doctest::IReporter {
    explicit Counter(const doctest::ContextOptions &) {}
    void report_query(const doctest::QueryData &) override {}
    void test_run_start() override {}
    void test_run_end(const doctest::TestRunStats &) override {}
    void test_case_start(const doctest::TestCaseData &test) override { // --first and --last choose, too
        ++cases_run;
        running = test.m_name;
        skips = false;
    }
    void test_case_reenter(const doctest::TestCaseData &) override {}
    void test_case_end(const doctest::CurrentTestCaseStats &stats) override {
        if (!stats.testCaseSuccess)
            ++cases_failed;
        else if (skips)
            ++cases_skipped;
    }
    void test_case_exception(const doctest::TestCaseException &) override {}
    void subcase_start(const doctest::SubcaseSignature &) override {}
    void subcase_end() override {}
    void log_assert(const doctest::AssertData &) override {}
    void log_message(const doctest::MessageData &) override {}
    void test_case_skipped(const doctest::TestCaseData &) override {}
};
REGISTER_LISTENER("counter", 0, Counter);

} // namespace

namespace wisp {

// Fixed-point numbers of the test build call this where the release saturates.
[[noreturn]] void fixed_overflow() { throw std::range_error("a fixed-point number left its range"); }

std::string data_path(const std::string &name) {
    const char *folder = std::getenv("WISP_DATA");
    return std::string(folder ? folder : DATA) + "/" + name;
}

void skip_case(const std::string &why) {
    skips = true;
    std::printf("skipped: %s: %s\n", running, why.c_str());
}

std::string built(const std::string &name) { return build_folder + name; }

} // namespace wisp

int main(int count, char **words) {
    // The arenas of thousands of small pictures are taken again from what was given back, not from the system.
    mallopt(M_MMAP_THRESHOLD, 32 << 20);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
    const std::string program = words[0];
    build_folder = program.substr(0, program.rfind('/') + 1); // "" where there is no '/'
    doctest::Context context(count, words);
    const int status = context.run();
    if (context.shouldExit()) return status;
    std::printf("%u passed, %u failed", cases_run - cases_failed - cases_skipped, cases_failed);
    if (cases_skipped > 0) std::printf(", %u skipped", cases_skipped);
    std::printf("\n");
    return status;
}
