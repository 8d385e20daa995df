#pragma once

#include <dds/dds.h>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

#include "modules/core/decoded.hpp"
#include "modules/core/io/bytes.hpp"
#include "modules/core/robot_identity.hpp"

namespace km {

/// Hash of the subject of a message. At the sender, a message replaces the stored one of equal key.
using MessageKey = std::uint64_t;

/// Key of messages whose subject these numbers identify.
[[nodiscard]] inline MessageKey message_key(std::initializer_list<std::uint64_t> numbers) {
  MessageKey key = kFnv1aBasis;
  for (const std::uint64_t number : numbers) mix_fnv1a(key, number);
  return key;
}

/// How messages of type T travel between robots. Specialised by the module that owns T, in its
/// `<module>_codec.hpp`:
///
///     template <>
///     struct Codec<InlierSet> : WireFormat<km_wire_InlierSet, km_wire_InlierSet_desc> {
///       static constexpr const char* kTopic = "inlier_sets"; // DDS topic name
///       static constexpr std::size_t kMaxBytes = 800000;     // longer ones are refused
///
///       struct Encoded {                         // owns what `wire` points to; movable
///         Wire wire{};
///         std::vector<km_wire_ClosureRef> closures;
///       };
///       static MessageKey key_of(const InlierSet&);
///       static Encoded encode(const InlierSet&);
///       static Decoded<InlierSet> decode(const Wire&, const TeamPeer&);  // checks all of Wire
///     };
template <typename T>
struct Codec;

/// The type of a codec that is generated from idl/, and its version (idl/README.md).
template <typename WireType, const dds_topic_descriptor_t& kDescriptor, std::uint16_t kNumber = 1>
struct WireFormat {
  using Wire = WireType;
  static constexpr std::uint16_t kVersion = kNumber;
  static const dds_topic_descriptor_t& descriptor() { return kDescriptor; }
  /// Hidden by codecs of types with sequences.
  struct Encoded {
    Wire wire{};
  };
};

// Sequences of generated types, for all codecs.

/// Points a sequence at `elements`, which it does not own: they outlive it and do not move.
template <typename Sequence, typename T>
void borrow(Sequence& sequence, std::vector<T>& elements) {
  const auto size = static_cast<std::uint32_t>(elements.size());
  sequence = {._maximum = size, ._length = size, ._buffer = elements.data(), ._release = false};
}

/// The elements of a received sequence; nullopt if there are more than `max` or they are missing.
template <typename Sequence>
[[nodiscard]] auto elements_of(const Sequence& sequence, std::size_t max) {
  using Span = std::span<const std::remove_pointer_t<decltype(sequence._buffer)>>;
  const bool usable =
      sequence._length <= max && (sequence._length == 0 || sequence._buffer != nullptr);
  return usable ? std::optional(Span(sequence._buffer, sequence._length)) : std::nullopt;
}

}  // namespace km
