#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string_view>
#include <vector>

#include "modules/core/decoded.hpp"

namespace km {

/// Maximum decompressed size of a chunk or message.
inline constexpr std::uint64_t kMaxDecompressed_bytes = std::uint64_t{512} << 20U;

/// Decompresses to `size` bytes. `compression` is "none" or "" (a copy), "lz4" (frames), "zstd", or
/// "bz2". Refuses a result of another size. Memory grows with the result, not with `size`.
Decoded<std::vector<std::uint8_t>> decompress(std::string_view compression,
                                              std::span<const std::uint8_t> bytes,
                                              std::uint64_t size);

/// Bounds the decompressed size of all chunks of a file, because kilobytes can decompress to
/// gigabytes: 64 MiB and 250 times the size of the file. Recordings of sensors stay far below.
class UnpackLimit {
 public:
  explicit UnpackLimit(std::uint64_t file_bytes)
      : left_bytes_((std::uint64_t{64} << 20U) + kRatio * file_bytes) {}

  /// False if decompressing the chunk at `begin` to `size` bytes exceeds the bound. A chunk that is
  /// read again does not count again.
  [[nodiscard]] bool accept(std::uint64_t begin, std::uint64_t size);

  static constexpr const char* kRefusal =
      "with the chunks before it, it decompresses to more than 64 MiB and 250 times the file";

 private:
  static constexpr std::uint64_t kRatio = 250;

  std::uint64_t left_bytes_;
  std::set<std::uint64_t> accepted_;
};

}  // namespace km
