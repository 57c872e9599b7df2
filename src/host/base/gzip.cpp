// zlib does the work; what is added is the limit on memory and errors that name the place.
#include "host/base/error.h"
#include "host/base/gzip.h"
#include "host/base/memory.h"
#include <algorithm>
#include <new>
#include <utility>
#define ZLIB_CONST // zlib does not write to its input, and then says so
#include <zlib.h>

namespace wisp {
namespace {

class Inflater {
  public:
    Inflater(const std::string &name, const unsigned char *data, size_t size)
        : name_(name), data_(data), size_(size), most_(gzip_allowance + gzip_largest_ratio * size) {
        constexpr int largest_window = 15, gzip_only = 16;
        if (inflateInit2(&stream_, largest_window + gzip_only) != Z_OK) throw std::bad_alloc();
    }
    ~Inflater() { inflateEnd(&stream_); }
    Inflater(const Inflater &) = delete;
    Inflater &operator=(const Inflater &) = delete;

    Bytes run() {
        while (read_ < size_) {
            member();
            inflateReset(&stream_);
        }
        bytes_.resize(written_);
        return std::move(bytes_);
    }

  private:
    [[noreturn]] void fail(const std::string &what) const {
        throw InputError(name_ + ": byte " + std::to_string(read_), what);
    }

    void member() {
        int status;
        do {
            if (written_ == bytes_.size()) grow();
            status = step();
            if (status == Z_BUF_ERROR && read_ == size_) fail("the gzip data ends early, expected more of it");
            if (status == Z_MEM_ERROR) throw std::bad_alloc();
            if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR)
                fail(std::string("damaged gzip data (") + (stream_.msg ? stream_.msg : "unknown") +
                     "), expected data as gzip writes it");
        } while (status != Z_STREAM_END);
    }

    // One call of zlib, whose own counts are too narrow for large files.
    int step() {
        const uInt input = clamped(size_ - read_), output = clamped(bytes_.size() - written_);
        stream_.next_in = data_ + read_;
        stream_.avail_in = input;
        stream_.next_out = bytes_.data() + written_;
        stream_.avail_out = output;
        const int status = inflate(&stream_, Z_NO_FLUSH);
        read_ += input - stream_.avail_in;
        written_ += output - stream_.avail_out;
        return status;
    }

    static uInt clamped(size_t size) { return static_cast<uInt>(std::min<size_t>(size, 1u << 30)); }

    void grow() {
        if (bytes_.size() >= most_)
            fail("inflates to more than " + std::to_string(most_) + " bytes, expected at most " +
                 std::to_string(gzip_largest_ratio) + " times its size");
        const size_t size = std::min(most_, bytes_.empty() ? 4 * size_ + 4096 : 2 * bytes_.size());
        require_memory(name_, "what is in the gzip file", size);
        bytes_.resize(size);
    }

    const std::string &name_;
    const unsigned char *data_;
    size_t size_, most_;
    size_t read_ = 0, written_ = 0;
    Bytes bytes_; // the first written_ are inflated
    z_stream stream_{};
};

} // namespace

bool is_gzip(const unsigned char *data, size_t size) { return size >= 2 && data[0] == 0x1f && data[1] == 0x8b; }

Bytes gunzip(const std::string &name, const unsigned char *data, size_t size) {
    return Inflater(name, data, size).run();
}

} // namespace wisp
