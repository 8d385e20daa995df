#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace km {

/// What decompress() makes the same bytes of: "" (a copy), "lz4" (a frame), "zstd"; quickly rather
/// than small. Throws std::invalid_argument for another name.
[[nodiscard]] std::vector<std::uint8_t> compress(std::string_view compression,
                                                 std::span<const std::uint8_t> bytes);

}  // namespace km
