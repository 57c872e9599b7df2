// PFM, the file that pictures are kept in and that their digests are of. No heap is needed.
#pragma once
#include "core/numbers/elementary.h"
#include "host/base/decimal.h"
#include <cstddef>

namespace wisp {

// Hands all bytes of the .pfm on in order: write(data, size). value(i): channel i % channels of pixel i / channels,
// rows from the top; channels: 1 or 3. The file has the bottom row first, little-endian.
template <class Value, class Write>
void write_pfm(int width, int height, size_t channels, Value &&value, Write &&write) {
    const auto text = [&write](const char *c) {
        for (; *c; ++c) write(c, size_t{1});
    };
    text(channels == 3 ? "PF\n" : "Pf\n");
    text(Decimal(static_cast<uint64_t>(width)).text());
    text(" ");
    text(Decimal(static_cast<uint64_t>(height)).text());
    text("\n-1.0\n");
    const size_t row = channels * static_cast<size_t>(width);
    for (size_t y = static_cast<size_t>(height); y-- > 0;)
        for (size_t i = y * row; i < (y + 1) * row; ++i) {
            const uint32_t bits = detail::to_bits(static_cast<float>(value(i)));
            char bytes[4];
            for (int k = 0; k < 4; ++k) bytes[k] = static_cast<char>(bits >> (8 * k));
            write(bytes, sizeof bytes);
        }
}

} // namespace wisp
