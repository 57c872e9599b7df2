#include "host/base/text.h"
#include <doctest/doctest.h>

using namespace wisp;

TEST_CASE("text: the kind of a file, and parts") {
    CHECK(ends_in("a.png", ".png"));
    CHECK(!ends_in(".png", ".png")); // a name is more than its kind
    CHECK(!ends_in("png", ".png"));
    CHECK(split("1:2:", ':') == std::vector<std::string>{"1", "2", ""});
    CHECK(split("", ':') == std::vector<std::string>{""});
}

TEST_CASE("text: numbers are decimal, finite, and all of the text") {
    CHECK(*to_number("3.") == 3);
    CHECK(*to_number("+.5") == 0.5);
    CHECK(!to_number("+-3"));
    CHECK(!to_number("inf"));
    CHECK(!to_number("nan"));
    CHECK(!to_number("0x10"));
    CHECK(!to_number("1x"));
    CHECK(!to_number(""));
    CHECK(*to_integer("070") == 70);
    CHECK(*to_integer("-3") == -3);
    CHECK(!to_integer("3.0"));
    CHECK(!to_integer("9223372036854775808"));
}

TEST_CASE("text: counts as people write them") {
    const struct {
        const char *text;
        int64_t count;
    } counts[] = {{"0", 0},          {"250000", 250000}, {"070", 70},
                  {"-3", -3},        {"1e6", 1000000},   {"1E6", 1000000},
                  {"2.5e5", 250000}, {"2.50e1", 25},     {"1e+06", 1000000},
                  {"1e0", 1},        {"1.0", 1},         {".5e1", 5},
                  {"250k", 250000},  {"2M", 2000000},    {"1G", 1000000000},
                  {"0.25M", 250000}, {"0k", 0},          {"9.2e18", 9200000000000000000}};
    for (const auto &c : counts) {
        CAPTURE(c.text);
        REQUIRE(to_count(c.text));
        CHECK(*to_count(c.text) == c.count);
    }
    CHECK(*to_count("9223372036854775807") == INT64_MAX);
    CHECK(*to_count("9223372036854775.807k") == INT64_MAX);
    CHECK(*to_count("9.223372036854775807e18") == INT64_MAX);
    for (const std::string &text :
         split("|.|k|e5|.e5|.k|1.5|1e-3|10e-1|2.55e1|1.2345k|1e|1e+|1e1.0|1e+-3|1e++3|1e6k|1kk|1m|1K|1 k|-1k|-1e3|+1e3|"
               "1.2.3k|1.-5e3|0x1k|nan|inf|1e19|10e18|1e999999999999999999999|9223372036854775808|"
               "9223372036854775.808k|9300000000G|9.223372036854775808e18",
               '|')) {
        CAPTURE(text);
        CHECK(!to_count(text));
    }
}

TEST_CASE("text: frame numbers take the place of %04d") {
    CHECK(numbered("a_%04d.png", 7) == "a_0007.png");
    CHECK(numbered("a_%d.png", 12345) == "a_12345.png");
    CHECK(numbered("100%.png", 7) == "100%.png");
    CHECK(numbered("%s%02d", 3) == "%s03");
    CHECK(has_number("%d"));
    CHECK(!has_number("%x"));
    CHECK(number_in("a_%04d.png", "a_0007.png") == 7);
    CHECK(number_in("a_%04d.png", "a_12345.png") == 12345);
    for (const char *other : {"a_7.png", "a_00007.png", "a_0007.pn", "a_.png", "a_xxxx.png", "a.png", ""})
        CHECK(!number_in("a_%04d.png", other));
    CHECK(!number_in("a.png", "a.png"));
}

TEST_CASE("text: a line of it is printable, and UTF-8 stays readable") {
    CHECK(printable("a b\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80~") == "a b\xc3\xa9\xe2\x82\xac\xf0\x9f\x98\x80~");
    CHECK(printable(std::string("\0\n\r\t\x1b\x7f", 6)) == "\\x00\\n\\r\\t\\x1b\\x7f");
    CHECK(printable("\xc2\x80\xc2\x9f\xc2\xa0") == "\\xc2\\x80\\xc2\\x9f\xc2\xa0"); // U+0080, U+009F; U+00A0
    CHECK(printable("\x9b\xff\xc3") == "\\x9b\\xff\\xc3");
    CHECK(printable("\xc0\x8a\xe0\x80\x8a\xf0\x80\x80\x8a") ==
          "\\xc0\\x8a\\xe0\\x80\\x8a\\xf0\\x80\\x80\\x8a"); // long \n
    CHECK(printable("\xed\xa0\x80\xf4\x90\x80\x80") == "\\xed\\xa0\\x80\\xf4\\x90\\x80\\x80");
    CHECK(printable(printable("\n\x1b")) == printable("\n\x1b"));
}

TEST_CASE("text: what was meant by a wrong word") {
    const std::vector<std::string> words = {"photons", "step", "light-step", "spp", "frames", "x"};
    const auto meant = [&](const std::string &word) { return did_you_mean(word, words, "--"); };
    CHECK(meant("photon") == "; did you mean '--photons'?");
    CHECK(meant("PHOTONS") == "; did you mean '--photons'?");
    CHECK(meant("phtoons") == "; did you mean '--photons'?");
    CHECK(meant("light") == "; did you mean '--light-step'?");
    CHECK(meant("ssp") == "; did you mean '--spp'?");
    CHECK(meant("frame") == "; did you mean '--frames'?");
    for (const std::string word : {"", "y", "gather", "bogus", "no"}) CHECK(meant(word).empty());
    CHECK(meant(std::string(100000, 'p')).empty());
}

TEST_CASE("text: two digits") {
    CHECK(two_digits(1.25) == "1.2");
    CHECK(two_digits(0.000341) == "0.00034");
    CHECK(two_digits(-0.0) == "0");
}
