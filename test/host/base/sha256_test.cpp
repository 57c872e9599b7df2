// SHA-256 against the examples of FIPS 180-4 and, at all lengths around a block, against sha256sum.
#include "host/base/sha256.h"
#include <cstring>
#include <doctest/doctest.h>
#include <string>

using namespace wisp;

namespace {
std::string digest_of(const std::string &message) { return sha256(message.data(), message.size()).text; }
} // namespace

TEST_CASE("sha256: FIPS 180 examples") {
    CHECK(digest_of("") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
    CHECK(digest_of("abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    CHECK(digest_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq") ==
          "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
    CHECK(digest_of("abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmnoijklmnopjklmnopqklmnopqrlmnopqrs"
                    "mnopqrstnopqrstu") == "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1");
}

TEST_CASE("sha256: one million times 'a', in pieces that do not fit blocks") {
    const std::string piece(1000, 'a');
    Sha256 hash;
    for (int i = 0; i < 1000; ++i) hash.update(piece.data(), piece.size());
    CHECK(std::string(hash.finish().text) == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("sha256: every length from 0 to 199") {
    // The digest of the digests (as text) of the messages 0, 1, 2 .. n-1 (as bytes), from another implementation.
    Sha256 all;
    std::string message;
    for (int n = 0; n < 200; ++n) {
        all.update(sha256(message.data(), message.size()).text, 64);
        message += static_cast<char>(n);
    }
    CHECK(std::string(all.finish().text) == "7a38a844c9e159de39f0862ee2e28569a8250831150a3fbf0a59c001129b2fb2");
}
