#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace km {

/// Compresses bytes for decompress(): "" (a copy), "lz4" (a frame), "zstd"; optimised for speed.
/// Throws std::invalid_argument for another name.
[[nodiscard]] std::vector<std::uint8_t> compress(std::string_view compression,
                                                 std::span<const std::uint8_t> bytes);

}  // namespace km
