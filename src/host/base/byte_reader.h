// A cursor over the bytes of one file: words and numbers of text, packed numbers of either byte order.
//
// Nothing is ever read beyond the end. A count is compared with the bytes that are left before it is used (require).
// Errors name the item that was read last: its line while the reader is set to text, its byte offset while it is set to
// binary. Lines are counted only for an error.
#pragma once
#include "host/base/error.h"
#include "host/base/text.h"
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

namespace wisp {

// How numbers are written: as decimal text, or packed with the least or the most significant byte first.
enum class Encoding : uint8_t { text, little_endian, big_endian };

enum class Scalar : uint8_t { i8, u8, i16, u16, i32, u32, i64, u64, f32, f64 };

// Bytes of one packed number.
constexpr size_t size_of(Scalar type) {
    constexpr size_t sizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
    return sizes[static_cast<size_t>(type)];
}

class ByteReader {
  public:
    // `name` stands in front of every error; the bytes must outlive the reader.
    ByteReader(const std::string &name, const unsigned char *data, size_t size, Encoding encoding = Encoding::text)
        : name_(name), data_(data), size_(size), encoding_(encoding) {}

    const std::string &name() const { return name_; }
    void set_encoding(Encoding encoding) { encoding_ = encoding; }
    bool is_text() const { return encoding_ == Encoding::text; }
    size_t left() const { return size_ - position_; }

    // Fewest bytes that a number takes: in text, one digit and what separates it from the next.
    size_t least_size(Scalar type) const { return is_text() ? 2 : size_of(type); }

    // Throws InputError about the item that was read last.
    [[noreturn]] void fail(const std::string &what) const {
        if (!is_text()) throw InputError(name_ + ": byte " + std::to_string(last_), what);
        const auto line = 1 + std::count(data_, data_ + last_, '\n');
        throw InputError(name_ + ":" + std::to_string(line), what);
    }

    // Fails unless `count` items of at least `bytes_each` bytes can be left in the file. `items` is their name.
    void require(uint64_t count, uint64_t bytes_each, const char *items) const {
        const uint64_t room = left() + (is_text() ? 1 : 0); // nothing separates the last number from the end
        if (bytes_each == 0 || count <= room / bytes_each) return;
        fail(std::to_string(count) + " " + items + ", expected at most " + std::to_string(room / bytes_each) +
             ": the file ends " + std::to_string(left()) + " bytes further on");
    }

    // The next bytes, at most `count` of them; the reader stays where it is.
    std::string_view peek(size_t count) const { return view(position_, position_ + std::min(count, left())); }

    // Steps over `count` bytes, or fails.
    std::string_view bytes(size_t count) {
        if (count > left()) fail_here("the file ends, expected " + std::to_string(count) + " bytes");
        last_ = position_;
        position_ += count;
        return view(last_, position_);
    }

    // --- text -------------------------------------------------------------------------------------------------------

    // Moves to the next word, on whatever line it is; false when there is none.
    bool find_word() {
        while (left() && is_space(data_[position_])) ++position_;
        return left() != 0;
    }

    // Moves over blanks to the next word of this line; false when there is none.
    bool find_word_in_line() {
        while (left() && is_space(data_[position_]) && data_[position_] != '\n') ++position_;
        return left() && data_[position_] != '\n';
    }

    // The next word. `expected` says what is missing where the file, or the line, ends before the word.
    std::string_view word(const char *expected) {
        if (!find_word()) fail_here(std::string("the file ends, expected ") + expected);
        return take_word();
    }
    std::string_view word_in_line(const char *expected) {
        if (!find_word_in_line()) fail_here(std::string("the line ends, expected ") + expected);
        return take_word();
    }

    // The rest of this line without its end.
    std::string_view line() {
        last_ = position_;
        const void *found = left() ? std::memchr(data_ + position_, '\n', left()) : nullptr;
        const size_t end = found ? static_cast<size_t>(static_cast<const unsigned char *>(found) - data_) : size_;
        position_ = found ? end + 1 : end;
        return view(last_, end > last_ && data_[end - 1] == '\r' ? end - 1 : end);
    }

    // Steps over the end of this line and not a byte further: a packed number may begin with what looks like a blank.
    void end_line() {
        if (find_word_in_line()) {
            const std::string_view extra = take_word();
            fail(quoted(extra) + ", expected the end of the line");
        }
        line();
    }

    // A decimal number of items; `expected` as for word().
    uint64_t count(const char *expected) {
        const std::string_view text = word(expected);
        uint64_t number = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
        if (error != std::errc() || end != text.data() + text.size()) fail(quoted(text) + ", expected " + expected);
        return number;
    }

    // Words in errors: one line whatever the file holds.
    static std::string quoted(std::string_view text) {
        constexpr size_t longest = 32;
        return "'" + printable(text.substr(0, longest)) + (text.size() > longest ? "...'" : "'");
    }

    // --- numbers ----------------------------------------------------------------------------------------------------

    // The next number. Text that stands for an f32 is rounded to one, so that both encodings give the same value.
    double number(Scalar type) { return is_text() ? to_number(word("a number"), type) : packed_number(type); }

    // The same where text must not go on to the next line.
    double number_in_line(Scalar type) {
        return is_text() ? to_number(word_in_line("another number"), type) : packed_number(type);
    }

    // The bits of the next packed number, for integers that no double holds.
    uint64_t packed_bits(Scalar type) {
        const size_t size = size_of(type);
        if (left() < size) fail_here("the file ends, expected a number of " + std::to_string(size) + " bytes");
        last_ = position_;
        position_ += size;
        uint64_t bits = 0;
        for (size_t i = 0; i < size; ++i)
            bits = bits << 8 | data_[encoding_ == Encoding::big_endian ? last_ + i : position_ - 1 - i];
        return bits;
    }

    // Steps over numbers.
    void skip_numbers(uint64_t count, Scalar type) {
        require(count, least_size(type), "numbers");
        if (!is_text())
            bytes(count * size_of(type));
        else
            for (uint64_t i = 0; i < count; ++i) word("a number");
    }

  private:
    static bool is_space(unsigned char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

    std::string_view view(size_t begin, size_t end) const {
        return std::string_view(reinterpret_cast<const char *>(data_) + begin, end - begin);
    }

    [[noreturn]] void fail_here(const std::string &what) {
        last_ = position_;
        fail(what);
    }

    std::string_view take_word() {
        last_ = position_;
        while (left() && !is_space(data_[position_])) ++position_;
        return view(last_, position_);
    }

    double to_number(std::string_view text, Scalar type) const {
        if (type == Scalar::f32) return parse<float>(text, std::strtof);
        return parse<double>(text, std::strtod);
    }

    template <class Float>
    Float parse(std::string_view text, Float (*parse_out_of_range)(const char *, char **)) const {
        const char *begin = text.data(), *end = begin + text.size();
        if (text.size() > 1 && text[0] == '+' && text[1] != '-') ++begin;
        Float number = 0;
        const auto [stop, error] = std::from_chars(begin, end, number);
        if (stop != end || error == std::errc::invalid_argument) fail(quoted(text) + ", expected a number");
        // from_chars gives no value beyond the range; this gives infinity or 0.
        if (error != std::errc()) return parse_out_of_range(std::string(begin, end).c_str(), nullptr);
        return number;
    }

    double packed_number(Scalar type) {
        const uint64_t bits = packed_bits(type);
        switch (type) {
        case Scalar::i8: return static_cast<int8_t>(bits);
        case Scalar::u8: return static_cast<uint8_t>(bits);
        case Scalar::i16: return static_cast<int16_t>(bits);
        case Scalar::u16: return static_cast<uint16_t>(bits);
        case Scalar::i32: return static_cast<int32_t>(bits);
        case Scalar::u32: return static_cast<uint32_t>(bits);
        case Scalar::i64: return static_cast<double>(static_cast<int64_t>(bits));
        case Scalar::u64: return static_cast<double>(bits);
        case Scalar::f32: return from_bits<float>(static_cast<uint32_t>(bits));
        case Scalar::f64: break;
        }
        return from_bits<double>(bits);
    }

    template <class Float, class Bits> static Float from_bits(Bits bits) {
        static_assert(sizeof(Float) == sizeof(Bits), "the bits of one number");
        Float number;
        std::memcpy(&number, &bits, sizeof number);
        return number;
    }

    std::string name_;
    const unsigned char *data_;
    size_t size_;
    Encoding encoding_;
    size_t position_ = 0; // of the next byte, at most size_
    size_t last_ = 0;     // where the item that was read last begins
};

} // namespace wisp
