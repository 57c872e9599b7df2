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

TEST_CASE("text: frame numbers take the place of %04d") {
    CHECK(numbered("a_%04d.png", 7) == "a_0007.png");
    CHECK(numbered("a_%d.png", 12345) == "a_12345.png");
    CHECK(numbered("100%.png", 7) == "100%.png");
    CHECK(numbered("%s%02d", 3) == "%s03");
    CHECK(has_number("%d"));
    CHECK(!has_number("%x"));
}
