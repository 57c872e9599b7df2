#include "host/base/sha256.h"
#include "host/base/text.h"
#include "host/results/checksummed_file.h"
#include <algorithm>

namespace wisp {

std::string ranges_text(const Ranges &ranges) {
    std::string text;
    for (const auto &[first, last] : ranges) text += " " + std::to_string(first) + ":" + std::to_string(last);
    return text;
}

void add_ranges(Ranges &ranges, const Ranges &more, const char *what, const std::string &name) {
    for (const auto &[first, last] : more)
        for (const auto &[low, high] : ranges)
            if (first < high && low < last)
                throw InputError(name, what + ranges_text(more) + ", expected none of" + ranges_text(ranges) +
                                           ", which are there already");
    ranges.insert(ranges.end(), more.begin(), more.end());
    std::sort(ranges.begin(), ranges.end());
    for (size_t i = 1; i < ranges.size();) {
        if (ranges[i - 1].second < ranges[i].first) {
            ++i;
            continue;
        }
        ranges[i - 1].second = ranges[i].second;
        ranges.erase(ranges.begin() + static_cast<ptrdiff_t>(i));
    }
}

Ranges read_ranges(ByteReader &reader, const char *what, int64_t end) {
    Ranges ranges;
    while (reader.find_word_in_line()) {
        const std::string range(reader.word("A:B"));
        const size_t colon = range.find(':');
        const auto first = to_integer(range.substr(0, colon));
        const auto last = colon == std::string::npos ? std::nullopt : to_integer(range.substr(colon + 1));
        if (!first || !last || *first < 0 || *first >= *last || *last > end)
            reader.fail(ByteReader::quoted(range) + ", expected a range A:B of " + what);
        if (!ranges.empty() && *first <= int64_t{ranges.back().second})
            reader.fail(ByteReader::quoted(range) + ", expected a range above the one before, and not touching it");
        ranges.emplace_back(static_cast<uint32_t>(*first), static_cast<uint32_t>(*last));
    }
    reader.end_line();
    return ranges;
}

int64_t read_integer(ByteReader &reader, const char *what, int64_t low, int64_t high) {
    const auto value = to_integer(std::string(reader.word(what)));
    if (!value || *value < low || *value > high) reader.fail(std::string("expected ") + what);
    return *value;
}

Bytes checksummed_bytes(const std::string &first, const std::string &lines, const Bytes &words) {
    Sha256 digest;
    digest.update(lines.data(), lines.size());
    digest.update(words.data(), words.size());
    const std::string head = first + "\nsha256 " + digest.finish().text + "\n" + lines;
    Bytes bytes(head.begin(), head.end());
    bytes.insert(bytes.end(), words.begin(), words.end());
    return bytes;
}

bool has_first_line(const Bytes &bytes, const std::string &first) {
    const std::string line = first + "\n";
    return bytes.size() >= line.size() && std::equal(line.begin(), line.end(), bytes.begin());
}

void read_checksum(ByteReader &reader, const std::string &first, const char *kind) {
    if (reader.peek(first.size() + 1) != first + "\n")
        reader.fail(std::string("not a ") + kind + ", expected '" + first + "'");
    reader.line();
    if (reader.word("sha256") != "sha256") reader.fail("expected 'sha256'");
    const std::string digest(reader.word("a SHA-256"));
    reader.end_line();
    const std::string_view rest = reader.peek(reader.left());
    if (digest != sha256(rest.data(), rest.size()).text)
        reader.fail("the file is damaged: its SHA-256 is another, expected " + digest);
}

void put_word(Bytes &bytes, uint64_t word) {
    for (int i = 0; i < 8; ++i) bytes.push_back(static_cast<uint8_t>(word >> (8 * i)));
}

uint64_t read_word(ByteReader &reader) {
    const std::string_view eight = reader.bytes(8);
    uint64_t value = 0;
    for (int i = 7; i >= 0; --i) value = value << 8 | static_cast<uint8_t>(eight[static_cast<size_t>(i)]);
    return value;
}

} // namespace wisp
