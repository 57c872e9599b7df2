// `wisp compare` as a user meets it.
#include "host/base/error.h"
#include "host/images/compare.h"
#include "host/images/exr.h"
#include "support/command_line.h"
#include <limits>

using namespace wisp;

namespace {

const float not_a_number = std::numeric_limits<float>::quiet_NaN();

// One row of grey pixels.
Picture row(const std::vector<float> &values) {
    Picture picture{static_cast<int>(values.size()), 1, {}};
    for (const float value : values) picture.rgb.insert(picture.rgb.end(), 3, value);
    return picture;
}

// What compare prints of them.
Difference judged(const Picture &a, const Picture &b, const Limits &limits = {}) {
    Difference difference = compare(a, b);
    judge(difference, limits);
    return difference;
}

// The exit status. `printed`: standard output, or the line of an error.
int run(const CommandLineTest &folder, const std::vector<std::string> &arguments, std::string &printed) {
    std::string line = "compare";
    for (const std::string &argument : arguments) line += " '" + argument + "'";
    const Ran ran = folder.wisp(line);
    if (ran.status > exit_difference) folder.refuses(ran, ran.status);
    printed = ran.out;
    if (!ran.err.empty()) printed += CommandLineTest::without_severity(ran.err.substr(0, ran.err.find('\n')));
    return ran.status;
}

} // namespace

TEST_CASE("compare command: exit status, with and without a tolerance") {
    CommandLineTest folder;
    const std::string a = folder.file("a.pfm"), b = folder.file("b.pfm"), bad = folder.file("bad.pfm");
    write_file(a, pfm_bytes(row({1.5f, 1.5f})));
    write_file(b, pfm_bytes(row({1, 1})));
    write_file(bad, pfm_bytes(row({1, not_a_number})));
    std::string printed;

    CHECK(run(folder, {a, a}, printed) == exit_done);
    CHECK(printed == difference_text(judged(row({1.5f, 1.5f}), row({1.5f, 1.5f}))));
    CHECK(run(folder, {a, b}, printed) == exit_difference);
    CHECK(printed == difference_text(judged(row({1.5f, 1.5f}), row({1, 1}))));

    // The relative RMSE is 0.5, exactly.
    CHECK(run(folder, {a, b, "--tolerance", "0.5"}, printed) == exit_done);
    CHECK(run(folder, {"--tolerance=0.5", a, b}, printed) == exit_done);
    CHECK(run(folder, {a, "--tolerance=0.49999999999999994", b}, printed) == exit_difference);
    CHECK(run(folder, {a, b, "--tolerance", "0"}, printed) == exit_difference);

    CHECK(run(folder, {bad, b, "--tolerance", "1e300"}, printed) == exit_difference); // NaN
    CHECK(run(folder, {b, bad, "--tolerance", "1e300"}, printed) == exit_difference);
    CHECK(run(folder, {bad, bad}, printed) == exit_done); // the same bits
    CHECK(run(folder, {bad, bad, "--tolerance", "0"}, printed) == exit_done);
}

TEST_CASE("compare command: JSON and difference picture") {
    CommandLineTest folder;
    const std::string a = folder.file("a.pfm"), b = folder.file("b.pfm");
    const Picture picture_a = row({1, 0, 0.5f}), picture_b = row({1, 0, 0.25f});
    write_file(a, pfm_bytes(picture_a));
    write_file(b, pfm_bytes(picture_b));
    const std::string json = difference_json(judged(picture_a, picture_b));
    const std::string text = difference_text(judged(picture_a, picture_b));
    std::string printed;

    CHECK(run(folder, {a, b, "--json", folder.file("d.json"), "--diff=" + folder.file("d.png")}, printed) ==
          exit_difference);
    CHECK(printed == text);
    const Bytes written = read_file(folder.file("d.json"));
    CHECK(std::string(written.begin(), written.end()) == json);
    CHECK(read_file(folder.file("d.png")) == png_bytes(difference_picture(picture_a, picture_b)));

    CHECK(run(folder, {a, b, "--json", "-"}, printed) == exit_difference);
    CHECK(printed == json); // alone, so that another program can read it
}

TEST_CASE("compare command: several limits") {
    CommandLineTest folder;
    const std::string a = folder.file("a.pfm"), b = folder.file("b.pfm");
    write_file(a, pfm_bytes(row({1.5f, 1.5f})));
    write_file(b, pfm_bytes(row({1, 1})));
    std::string printed;
    const auto last_line = [&](const std::vector<std::string> &limits, int status) {
        std::vector<std::string> words = {a, b};
        words.insert(words.end(), limits.begin(), limits.end());
        CHECK(run(folder, words, printed) == status);
        return printed.substr(printed.rfind("the pictures"));
    };
    const std::string within = "the pictures are within the tolerance\n";
    CHECK(last_line({}, exit_difference) == "the pictures are different\n");
    CHECK(last_line({"--max-flip", "0"}, exit_done) == within); // PNG shows both as white
    CHECK(last_line({"--max-ulps", "4194304"}, exit_done) == within);
    CHECK(last_line({"--max-ulps", "5M", "--tolerance", "0.5", "--max-flip=1"}, exit_done) == within);
    CHECK(last_line({"--max-ulps", "4M", "--tolerance", "0.5"}, exit_difference) ==
          "the pictures are different: largest difference in ulps above 4000000\n");
    CHECK(last_line({"--max-ulps", "4M", "--tolerance", "0.4"}, exit_difference) ==
          "the pictures are different: relative RMSE above 0.4, largest difference in ulps above 4000000\n");
}

TEST_CASE("compare command: pictures of other kinds, known by their contents") {
    CommandLineTest folder;
    const std::string pfm = folder.file("a.pfm"), png = folder.file("a.png"), other = folder.file("b.png");
    const float grey = static_cast<float>(srgb_to_linear(30 / 255.0));
    write_file(pfm, pfm_bytes(row({0, grey, 1})));
    write_file(png, png_bytes(row({0, grey, 1})));
    write_file(other, png_bytes(row({0, grey, 0.5f})));
    std::string printed;
    CHECK(run(folder, {png, png}, printed) == exit_done);
    CHECK(run(folder, {pfm, png}, printed) == exit_done); // equal to the bit
    const std::string exr = folder.file("a.exr");
    write_file(exr, exr_bytes(row({0, grey, 1})));
    CHECK(run(folder, {exr, pfm}, printed) == exit_done);
    CHECK(run(folder, {other, exr}, printed) == exit_difference);
    folder.write("b.exr", text_of(exr).substr(0, 200));
    CHECK(run(folder, {folder.file("b.exr"), exr}, printed) == exit_input);
    CHECK(printed.rfind(folder.file("b.exr: byte "), 0) == 0);
    CHECK(run(folder, {png, other}, printed) == exit_difference);
    CHECK(printed.find("first differing pixel           2 0\n") != std::string::npos);
    CHECK(run(folder, {other, pfm, "--json", "-"}, printed) == exit_difference);
    CHECK(printed.find("\"verdict\": \"different\" }\n") != std::string::npos);

    const std::string whole = text_of(png);
    folder.write("b.png", whole.substr(0, whole.size() - 20));
    CHECK(run(folder, {pfm, other}, printed) == exit_input);
    CHECK(printed.rfind(other + ": byte ", 0) == 0);
    folder.write("b.png", "JFIF");
    CHECK(run(folder, {other, pfm}, printed) == exit_input);
    CHECK(printed == other + ": byte 0: not a picture, expected a PFM, a PNG or an EXR");
    if (has_address_sanitizer) return skip_case("no limit on addresses with AddressSanitizer");
    const Picture large{2000, 2000, std::vector<float>(12000000)};
    write_file(folder.file("large.png"), png_bytes(large));
    write_file(folder.file("large.exr"), exr_bytes(large));
    for (const auto &[name, bytes] : {std::pair("large.png", "100000000"), {"large.exr", "144768000"}}) {
        const Ran ran = folder.wisp_within(100000, "compare " + folder.file(name) + " " + pfm);
        folder.refuses(ran, exit_memory);
        CHECK(ran.err.find(std::string("the picture needs ") + bytes + " bytes") != std::string::npos);
    }
}

TEST_CASE("compare command: the noise of B") {
    CommandLineTest folder;
    std::string printed;
    write_file(folder.file("a.pfm"), pfm_bytes(row({6, 8})));
    write_file(folder.file("b.pfm"), pfm_bytes(row({1, 3})));
    write_file(folder.file("e.pfm"), pfm_bytes(row({3, 3})));
    write_file(folder.file("wide.pfm"), pfm_bytes(row({1, 1, 1})));
    CHECK(run(folder, {folder.file("a.pfm"), folder.file("b.pfm"), "--error", folder.file("e.pfm")}, printed) ==
          exit_difference);
    CHECK(printed.find("relative noise of B             1.5\n") != std::string::npos);
    CHECK(run(folder, {folder.file("a.pfm"), folder.file("b.pfm"), "--error", folder.file("wide.pfm")}, printed) ==
          exit_input);
    CHECK(printed.find("3 x 1 pixels, expected 2 x 1 as in") != std::string::npos);
}

TEST_CASE("compare command: errors") {
    CommandLineTest folder;
    const std::string a = folder.file("a.pfm"), wide = folder.file("wide.pfm"), none = folder.file("none.pfm");
    write_file(a, pfm_bytes(row({1})));
    write_file(wide, pfm_bytes(row({1, 1})));
    std::string printed;

    const auto usage = [&](const std::vector<std::string> &args, const std::string &line) {
        CHECK(run(folder, args, printed) == exit_usage);
        CHECK(printed == line);
    };
    usage({}, "'wisp compare' has 0 files, expected two pictures");
    usage({a}, "'wisp compare' has 1 files, expected two pictures");
    usage({a, a, a}, "'wisp compare' has 3 files, expected two pictures");
    usage({a, a, "--fuzzy"}, "there is no option '--fuzzy' of compare, expected --tolerance, --max-flip, --max-ulps, "
                             "--error, --json or --diff");
    usage(
        {a, a, "-t", "1"},
        "there is no option '-t' of compare, expected --tolerance, --max-flip, --max-ulps, --error, --json or --diff");
    usage({a, a, "--tolerance"}, "option '--tolerance' needs a value: REL");
    for (const char *value : {"", "abc", "-1", "nan", "inf", "1x", "0x1"})
        usage({a, a, "--tolerance", value},
              std::string("option 'tolerance': found '") + value + "', expected a number of at least 0");
    usage({a, a, "--max-flip", "1.1"}, "option 'max-flip': found '1.1', expected a number from 0 to 1");
    usage({a, a, "--max-ulps", "1.5"}, "option 'max-ulps': found '1.5', expected a whole number from 0 to 4294967295");
    usage({a, a, "--json="}, "option 'json': found '', expected a file name or -");
    usage({a, a, "--diff", "d.jpg"}, "option 'diff': found 'd.jpg', expected a file name that ends in .png");

    CHECK(run(folder, {a, none}, printed) == exit_input);
    CHECK(printed == none + ": cannot be opened: " + std::strerror(ENOENT));
    CHECK(run(folder, {a, wide}, printed) == exit_input);
    CHECK(printed == wide + ": 2 x 1 pixels, expected 1 x 1 as in " + a);
    const std::string nowhere = folder.file("none/d.json");
    CHECK(run(folder, {a, a, "--json", nowhere}, printed) == exit_output);
    CHECK(printed == nowhere + ": could not be written: " + std::strerror(ENOENT));
}
