#include "modules/recordings/compress.hpp"

#include <lz4frame.h>
#include <zstd.h>

#include <stdexcept>
#include <string>

namespace km {

std::vector<std::uint8_t> compress(std::string_view compression,
                                   std::span<const std::uint8_t> bytes) {
  constexpr int kFast = 1;
  std::vector<std::uint8_t> packed;
  // Both libraries succeed with a buffer of their bound on the compressed size.
  if (compression.empty()) {
    packed.assign(bytes.begin(), bytes.end());
  } else if (compression == "zstd") {
    packed.resize(ZSTD_compressBound(bytes.size()));
    packed.resize(ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), kFast));
  } else if (compression == "lz4") {
    packed.resize(LZ4F_compressFrameBound(bytes.size(), nullptr));
    packed.resize(
        LZ4F_compressFrame(packed.data(), packed.size(), bytes.data(), bytes.size(), nullptr));
  } else {
    throw std::invalid_argument("no compression '" + std::string(compression) + "'");
  }
  return packed;
}

}  // namespace km
