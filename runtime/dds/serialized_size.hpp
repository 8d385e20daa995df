#pragma once

#include <dds/dds.h>

#include <cstdint>

namespace km {

/// Bytes of `wire`, a sample of `type`, as DDS sends it: its serializer's, the encoding header
/// included, padded to 4.
[[nodiscard]] std::uint64_t serialized_size(const dds_topic_descriptor_t& type, const void* wire);

}  // namespace km
