#include "runtime/dds/serialized_size.hpp"

#include <dds/ddsi/ddsi_cdrstream.h>

namespace km {

std::uint64_t serialized_size(const dds_topic_descriptor_t& type, const void* wire) {
  constexpr std::uint32_t kXcdr2 = 2;  // the encoding of @appendable types
  constexpr std::uint64_t kEncodingHeader = 4;
  dds_ostream_t stream;
  dds_ostream_init(&stream, 0, kXcdr2);
  dds_stream_write(&stream, static_cast<const char*>(wire), type.m_ops);
  const std::uint64_t size = stream.m_index;
  dds_ostream_fini(&stream);
  return (kEncodingHeader + size + 3) / 4 * 4;
}

}  // namespace km
