#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "modules/core/decoded.hpp"

namespace km {

/// Maximum decompressed size of a chunk or message; a larger size is treated as an error.
inline constexpr std::uint64_t kMaxDecompressed_bytes = std::uint64_t{512} << 20U;

/// `size` bytes from what was compressed as recordings name it: "none" or "" (not at all), "lz4"
/// (frames), "zstd", "bz2". Refuses what has another size. Memory grows with what comes out, not
/// with `size`.
Decoded<std::vector<std::uint8_t>> decompress(std::string_view compression,
                                              std::span<const std::uint8_t> bytes,
                                              std::uint64_t size);

}  // namespace km
