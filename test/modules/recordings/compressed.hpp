#pragma once

#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <catch2/catch.hpp>
#include <cstdint>
#include <string>
#include <vector>

namespace km {

/// Compresses by the libraries' calls for one piece, which decompress() does not use: "" or "none"
/// (a copy), "lz4", "zstd", "bz2".
inline std::vector<std::uint8_t> compressed(const std::string& compression,
                                            std::vector<std::uint8_t> plain) {
  if (compression.empty() || compression == "none") return plain;
  std::vector<std::uint8_t> packed(2 * plain.size() + 1000);
  std::size_t size = 0;
  if (compression == "lz4")
    size = LZ4F_compressFrame(packed.data(), packed.size(), plain.data(), plain.size(), nullptr);
  if (compression == "zstd")
    size = ZSTD_compress(packed.data(), packed.size(), plain.data(), plain.size(), 1);
  if (compression == "bz2") {
    plain.reserve(1);  // the library takes no null pointer
    auto written = static_cast<unsigned>(packed.size());
    REQUIRE(BZ2_bzBuffToBuffCompress(reinterpret_cast<char*>(packed.data()), &written,
                                     reinterpret_cast<char*>(plain.data()),
                                     static_cast<unsigned>(plain.size()), 1, 0, 0) == BZ_OK);
    size = written;
  }
  REQUIRE(size > 0);
  packed.resize(size);
  return packed;
}

}  // namespace km
