#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include <catch2/catch.hpp>
#include <random>
#include <string>

#include "modules/recordings/decompress.hpp"

namespace km {
namespace {

// Compresses by the libraries' calls for one piece, which decompress() does not use: "" or "none"
// (a copy), "lz4", "zstd", "bz2".
std::vector<std::uint8_t> compressed(const std::string& compression,
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

// Numbers that compress to about a half.
std::vector<std::uint8_t> plain_bytes(std::size_t size) {
  std::mt19937 rng(7);
  std::vector<std::uint8_t> bytes(size);
  for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(rng() % 13);
  return bytes;
}

TEST_CASE("Decompression restores the compressed bytes", "[recordings]") {
  const std::string compression = GENERATE("none", "lz4", "zstd", "bz2");
  const std::size_t size = GENERATE(0U, 1U, 1000U, 1U << 20U, 5'000'001U);
  CAPTURE(compression, size);
  const auto plain = plain_bytes(size);
  const auto result = decompress(compression, compressed(compression, plain), size);
  REQUIRE(result.value);
  CHECK(*result.value == plain);
}

TEST_CASE("Compressed bytes of another size than they state are refused", "[recordings]") {
  const std::string compression = GENERATE("none", "lz4", "zstd", "bz2");
  CAPTURE(compression);
  const auto packed = compressed(compression, plain_bytes(3'000'000));
  const std::span<const std::uint8_t> whole(packed);
  CHECK_FALSE(decompress(compression, whole, 2'999'999).value);
  CHECK_FALSE(decompress(compression, whole, 3'000'001).value);
  CHECK_FALSE(decompress(compression, whole, 0).value);
  CHECK_FALSE(decompress(compression, whole, std::uint64_t{1} << 40U).value);
  CHECK_FALSE(decompress(compression, whole.first(packed.size() - 1), 3'000'000).value);
  CHECK_FALSE(decompress(compression, {}, 3'000'000).value);
  auto longer = packed;
  longer.push_back(0);
  CHECK_FALSE(decompress(compression, longer, 3'000'000).value);
  CHECK_FALSE(decompress("gzip", whole, 3'000'000).value);
}

}  // namespace
}  // namespace km
