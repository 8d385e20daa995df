#include "modules/mesh/chunk_packing.hpp"

#include <zstd.h>

#include <algorithm>
#include <array>
#include <numeric>

namespace km {
namespace {

using Bytes = std::vector<std::uint8_t>;
using ChunkTriple = MeshChunk::Triple;

constexpr int kFastest = 1;          // higher levels of Zstandard save less than 3 %
constexpr double kRowCell_m = 0.05;  // about the distance of neighbouring vertices of a full map

enum class Triples { kOffsets, kFaces };

// The number from which element `axis` of triple `i` is stated as a difference. Most faces are like
// the face before them, and the third corner is near the second.
std::uint16_t reference_of(const std::vector<ChunkTriple>& triples, std::size_t i, std::size_t axis,
                           Triples kind) {
  if (kind == Triples::kFaces && axis == 2) return triples[i][1];
  return i == 0 ? std::uint16_t{0} : triples[i - 1][axis];
}

// A difference modulo 2^16, so that small differences of both signs have a high byte of zero: 0,
// -1, 1, -2, ... become 0, 1, 2, 3, ...
std::uint16_t code_of(std::uint16_t value, std::uint16_t reference) {
  const auto difference = static_cast<std::uint16_t>(value - reference);
  const bool is_negative = difference >= 0x8000U;
  return static_cast<std::uint16_t>(is_negative ? 2U * (0xFFFFU - difference) + 1U
                                                : 2U * difference);
}

std::uint16_t value_of(std::uint16_t code, std::uint16_t reference) {
  const unsigned half = code / 2U;
  return static_cast<std::uint16_t>(reference + (code % 2U == 0 ? half : 0xFFFFU - half));
}

void append(const std::vector<ChunkTriple>& triples, Triples kind, Bytes& plain) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t low = plain.size(), high = low + triples.size();
    plain.resize(high + triples.size());
    for (std::size_t i = 0; i < triples.size(); ++i) {
      const std::uint16_t code = code_of(triples[i][axis], reference_of(triples, i, axis, kind));
      plain[low + i] = static_cast<std::uint8_t>(code & 0xFFU);
      plain[high + i] = static_cast<std::uint8_t>(code >> 8U);
    }
  }
}

// Takes bytes from the front of `plain`.
void take(std::span<const std::uint8_t>& plain, Triples kind, std::vector<ChunkTriple>& triples) {
  const std::size_t size = triples.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t i = 0; i < size; ++i) {
      const auto code = static_cast<std::uint16_t>(plain[i] | plain[size + i] << 8U);
      triples[i][axis] = value_of(code, reference_of(triples, i, axis, kind));
    }
    plain = plain.subspan(2 * size);
  }
}

// A byte of each element, less that of the element before.
void append_differences(const auto& elements, auto byte_of, Bytes& plain) {
  std::uint8_t before = 0;
  for (const auto& element : elements) {
    plain.push_back(static_cast<std::uint8_t>(byte_of(element) - before));
    before = byte_of(element);
  }
}

// Takes a byte of each vertex from the front of `plain`.
void take_differences(std::span<const std::uint8_t>& plain, auto byte_of,
                      const ChunkCounts& counts) {
  std::uint8_t before = 0;
  for (std::size_t v = 0; v < counts.vertices; ++v)
    before = byte_of(v) = static_cast<std::uint8_t>(before + plain[v]);
  plain = plain.subspan(counts.vertices);
}

// Channels of a colour. Red and blue less half of green are near zero for grey.
std::uint8_t green_of(std::uint16_t color) {
  return static_cast<std::uint8_t>(color >> 5U & 63U);
}
std::uint8_t red_over_green(std::uint16_t color) {
  return static_cast<std::uint8_t>((color >> 11U) - green_of(color) / 2U);
}
std::uint8_t blue_over_green(std::uint16_t color) {
  return static_cast<std::uint8_t>((color & 31U) - green_of(color) / 2U);
}

// Takes the colours of the vertices from the front of `plain`.
void take_colors(std::span<const std::uint8_t>& plain, const ChunkCounts& counts,
                 std::vector<std::uint16_t>& colors) {
  std::array<Bytes, 3> channels;
  for (Bytes& channel : channels) {
    channel.resize(counts.vertices);
    take_differences(
        plain, [&](std::size_t v) -> auto& { return channel[v]; }, counts);
  }
  for (std::size_t v = 0; v < counts.vertices; ++v) {
    const unsigned green = channels[0][v] & 63U;
    const unsigned red = (channels[1][v] + green / 2U) & 31U;
    const unsigned blue = (channels[2][v] + green / 2U) & 31U;
    colors.push_back(static_cast<std::uint16_t>(red << 11U | green << 5U | blue));
  }
}

// The bytes before compression.
std::size_t plain_size(const ChunkCounts& counts) {
  return (6 + (counts.labelled ? 1 : 0) + (counts.coloured ? 3 : 0) + (counts.seen ? 2 : 0)) *
             counts.vertices +
         6 * counts.faces;
}

template <typename T>
void reorder(std::vector<T>& values, const std::vector<std::uint16_t>& order) {
  if (values.empty()) return;
  std::vector<T> result;
  result.reserve(values.size());
  for (const std::uint16_t i : order) result.push_back(values[i]);
  values = std::move(result);
}

}  // namespace

MeshChunk sorted_in_space(const MeshChunk& chunk) {
  MeshChunk sorted = chunk;
  std::vector<std::uint16_t> order(chunk.offsets.size()), place(chunk.offsets.size());
  std::iota(order.begin(), order.end(), std::uint16_t{0});
  const auto cell = static_cast<unsigned>(
      std::clamp(kRowCell_m / static_cast<double>(chunk.step_m), 1.0, 65535.0));
  std::ranges::stable_sort(order, {}, [&](std::uint16_t v) {
    const auto [x, y, z] = chunk.offsets[v];
    return std::array{z / cell, y / cell, x / cell};
  });
  for (std::size_t i = 0; i < order.size(); ++i) place[order[i]] = static_cast<std::uint16_t>(i);
  reorder(sorted.offsets, order);
  reorder(sorted.labels, order);
  reorder(sorted.colors, order);
  reorder(sorted.views, order);
  for (ChunkTriple& face : sorted.faces) {
    for (std::uint16_t& corner : face) corner = place[corner];
    std::ranges::rotate(face, std::ranges::min_element(face));  // same orientation
  }
  std::ranges::sort(sorted.faces);
  return sorted;
}

std::vector<std::uint8_t> packed(const MeshChunk& chunk) {
  if (chunk.offsets.empty()) return {};
  Bytes plain;
  plain.reserve(plain_bytes(chunk));
  append(chunk.offsets, Triples::kOffsets, plain);
  append(chunk.faces, Triples::kFaces, plain);
  plain.insert(plain.end(), chunk.labels.begin(), chunk.labels.end());
  append_differences(chunk.colors, green_of, plain);
  append_differences(chunk.colors, red_over_green, plain);
  append_differences(chunk.colors, blue_over_green, plain);
  for (std::size_t i = 0; i < 2; ++i)
    append_differences(
        chunk.views, [i](const auto& views) { return views[i]; }, plain);
  // Compression succeeds with a buffer of this size.
  Bytes result(ZSTD_compressBound(plain.size()));
  result.resize(ZSTD_compress(result.data(), result.size(), plain.data(), plain.size(), kFastest));
  return result;
}

bool unpack(std::span<const std::uint8_t> bytes, const ChunkCounts& counts, MeshChunk& chunk) {
  const std::size_t size = plain_size(counts);
  if (size == 0) return bytes.empty();
  if (size > kMaxChunkBytes) return false;
  Bytes content(size);
  if (ZSTD_decompress(content.data(), size, bytes.data(), bytes.size()) != size) return false;
  std::span<const std::uint8_t> plain = content;
  chunk.offsets.resize(counts.vertices);
  chunk.faces.resize(counts.faces);
  take(plain, Triples::kOffsets, chunk.offsets);
  take(plain, Triples::kFaces, chunk.faces);
  if (counts.labelled) {
    chunk.labels.assign(plain.begin(),
                        plain.begin() + static_cast<std::ptrdiff_t>(counts.vertices));
    plain = plain.subspan(counts.vertices);
  }
  if (counts.coloured) take_colors(plain, counts, chunk.colors);
  if (!counts.seen) return true;
  chunk.views.resize(counts.vertices);
  for (std::size_t i = 0; i < 2; ++i)
    take_differences(
        plain, [&](std::size_t v) -> auto& { return chunk.views[v][i]; }, counts);
  return true;
}

std::size_t wire_bytes(const MeshChunk& chunk) {
  return kChunkFixedBytes + packed(chunk).size() + kMeshKeyframeBytes * chunk.keyframes.size();
}

}  // namespace km
