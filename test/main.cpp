// Runs every test; the last line says how many passed and failed.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>
#include <cstdio>
#include <stdexcept>

namespace wisp {

// Fixed-point numbers of the test build call this where the release saturates.
[[noreturn]] void fixed_overflow() { throw std::range_error("a fixed-point number left its range"); }

} // namespace wisp

namespace {

unsigned cases_run = 0, cases_failed = 0;

struct Counter : doctest::IReporter {
    explicit Counter(const doctest::ContextOptions &) {}
    void test_run_end(const doctest::TestRunStats &stats) override {
        cases_failed = stats.numTestCasesFailed;
    }
    void report_query(const doctest::QueryData &) override {}
    void test_run_start() override {}
    void test_case_start(const doctest::TestCaseData &) override { ++cases_run; } // --first and --last choose, too
    void test_case_reenter(const doctest::TestCaseData &) override {}
    void test_case_end(const doctest::CurrentTestCaseStats &) override {}
    void test_case_exception(const doctest::TestCaseException &) override {}
    void subcase_start(const doctest::SubcaseSignature &) override {}
    void subcase_end() override {}
    void log_assert(const doctest::AssertData &) override {}
    void log_message(const doctest::MessageData &) override {}
    void test_case_skipped(const doctest::TestCaseData &) override {}
};
REGISTER_LISTENER("counter", 0, Counter);

} // namespace

int main(int count, char **words) {
    doctest::Context context(count, words);
    const int status = context.run();
    if (context.shouldExit()) return status;
    std::printf("%u passed, %u failed\n", cases_run - cases_failed, cases_failed);
    return status;
}
