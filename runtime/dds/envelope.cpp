#include "runtime/dds/envelope.hpp"

#include <dds/ddsi/ddsi_cdrstream.h>

#include <algorithm>
#include <bit>
#include <cstring>

namespace km {
namespace {

constexpr std::uint32_t kXcdr2 = 2;  // the encoding of @appendable types

}  // namespace

std::vector<std::uint8_t> serialize(const dds_topic_descriptor_t& type, const void* wire) {
  dds_ostreamLE_t stream;
  dds_ostreamLE_init(&stream, 0, kXcdr2);
  dds_stream_writeLE(&stream, static_cast<const char*>(wire), type.m_ops);
  std::vector<std::uint8_t> bytes(stream.x.m_buffer, stream.x.m_buffer + stream.x.m_index);
  dds_ostreamLE_fini(&stream);
  return bytes;
}

WireSample::WireSample(const dds_topic_descriptor_t& type)
    : type_(type), sample_(type.m_size / sizeof(std::max_align_t) + 1) {
  std::memset(sample_.data(), 0, type.m_size);
}

WireSample::~WireSample() {
  dds_stream_free_sample(sample_.data(), type_.m_ops);
}

bool WireSample::read(std::span<const std::uint8_t> bytes) {
  // An aligned copy, because DDS assumes alignment and converts the byte order in place. It is
  // twice as long, because Cyclone DDS 0.10.2 counts four bytes for each number of eight when it
  // compares an array with the size.
  std::vector<std::uint64_t> aligned(2 * bytes.size() / sizeof(std::uint64_t) + 1);
  std::ranges::copy(bytes, reinterpret_cast<std::uint8_t*>(aligned.data()));  // `bytes` may be
                                                                              // empty
  const auto size = static_cast<std::uint32_t>(bytes.size());
  const bool swap = std::endian::native == std::endian::big;
  std::uint32_t end = 0;
  if (dds_stream_normalize_data(reinterpret_cast<char*>(aligned.data()), &end, size, swap, kXcdr2,
                                type_.m_ops) == nullptr ||
      end != size)
    return false;
  dds_istream_t stream;
  dds_istream_init(&stream, size, aligned.data(), kXcdr2);
  dds_stream_read(&stream, reinterpret_cast<char*>(sample_.data()), type_.m_ops);
  dds_istream_fini(&stream);
  return stream.m_index <= size;
}

}  // namespace km
