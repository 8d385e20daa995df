#include <catch2/catch.hpp>

#include "modules/recordings/decompress.hpp"
#include "test/modules/recordings/compressed.hpp"

namespace km {
namespace {

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

TEST_CASE("The decompressed chunks of a file are bounded together, each counted once",
          "[recordings]") {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20U;
  UnpackLimit limit(4 * kMiB);  // 64 MiB + 1000 MiB
  CHECK(limit.accept(0, 500 * kMiB));
  CHECK(limit.accept(0, 500 * kMiB));
  CHECK_FALSE(limit.accept(1, 565 * kMiB));
  CHECK(limit.accept(2, 564 * kMiB));
  CHECK_FALSE(limit.accept(3, 1));
}

}  // namespace
}  // namespace km
