#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "modules/core/decoded.hpp"

namespace km {

/// Maximum decompressed size of a chunk or message.
inline constexpr std::uint64_t kMaxDecompressed_bytes = std::uint64_t{512} << 20U;

/// Decompresses to `size` bytes. `compression` is "none" or "" (a copy), "lz4" (frames), "zstd", or
/// "bz2". Refuses a result of another size.
Decoded<std::vector<std::uint8_t>> decompress(std::string_view compression,
                                              std::span<const std::uint8_t> bytes,
                                              std::uint64_t size);

}  // namespace km
