#include <bzlib.h>
#include <lz4frame.h>
#include <zstd.h>

#include "modules/recordings/chunked_file.hpp"
#include "test/modules/recordings/bag_contents.hpp"
#include "test/support/test.hpp"

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

TEST_CASE("Decompression restores the compressed bytes") {
  const std::string compression = GENERATE("none", "lz4", "zstd", "bz2");
  const std::size_t size = GENERATE(0U, 1U, 1000U, 1U << 20U, 5'000'001U);
  CAPTURE(compression, size);
  const auto plain = plain_bytes(size);
  const auto result = decompress(compression, compressed(compression, plain), size);
  REQUIRE(result.value);
  CHECK(*result.value == plain);
}

TEST_CASE("Compressed bytes of another size than they state are refused") {
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

struct Merged {
  std::vector<BagMessage> messages;
  std::vector<Stamp> lost;
  std::size_t loads = 0;
};

// A chunk for each list of times; a message's bytes are its number, counted through all chunks.
Merged merge(const std::vector<std::vector<Stamp>>& times, const std::vector<Stamp>& firsts,
             std::uint64_t held_bytes = ChunkMerge::kHeld_bytes) {
  std::vector<ChunkRange> places;
  std::vector<Chunk> chunks;
  std::uint8_t number = 0;
  for (std::size_t i = 0; i < times.size(); ++i) {
    places.push_back({.begin = i, .end = i + 1, .first = firsts[i]});
    Chunk chunk;
    for (const Stamp time : times[i]) {
      chunk.entries.push_back({.log_time = time, .size = 1, .begin = chunk.bytes.size()});
      chunk.bytes.push_back(number++);
    }
    chunks.push_back(chunk);
  }
  Merged merged;
  ChunkMerge merger(
      places,
      [&](const ChunkRange& place) {
        ++merged.loads;
        return chunks[place.begin];
      },
      [&](const ChunkRange&, const Chunk::Entry& entry) { merged.lost.push_back(entry.log_time); },
      held_bytes);
  while (auto message = merger.next()) merged.messages.push_back(*std::move(message));
  return merged;
}

TEST_CASE("Messages of chunks that overlap come in order of time and of the file") {
  // Few enough times that many are equal.
  std::mt19937 rng(GENERATE(1U, 2U, 3U));
  const std::uint64_t held_bytes = GENERATE(std::uint64_t{0}, std::uint64_t{25}, ~std::uint64_t{0});
  std::vector<std::vector<Stamp>> times(12);
  std::vector<Stamp> firsts;
  std::vector<std::pair<Stamp, std::uint8_t>> expected;
  std::uint8_t number = 0;
  for (auto& chunk : times) {
    const auto base = static_cast<Stamp>(rng() % 30);
    for (auto k = rng() % 20; k > 0; --k) {
      chunk.push_back(base + static_cast<Stamp>(rng() % 10));
      expected.emplace_back(chunk.back(), number++);
    }
    firsts.push_back(chunk.empty() ? base : *std::min_element(chunk.begin(), chunk.end()));
  }
  std::sort(expected.begin(), expected.end());
  const Merged merged = merge(times, firsts, held_bytes);
  REQUIRE(merged.messages.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(merged.messages[i].log_time == expected[i].first);
    CHECK(merged.messages[i].bytes == std::vector{expected[i].second});
  }
  CHECK(merged.lost.empty());
  CHECK((merged.loads == times.size()) == (held_bytes > 25));
}

TEST_CASE("Messages are dropped if their chunk begins earlier than stated") {
  const Merged merged = merge({{100, 101, 102, 103}, {99, 100, 103, 104}}, {100, 102});
  CHECK(merged.lost == std::vector<Stamp>{99, 100});
  check_order(merged.messages);
  CHECK(merged.messages.size() == 6);
}

}  // namespace
}  // namespace km
