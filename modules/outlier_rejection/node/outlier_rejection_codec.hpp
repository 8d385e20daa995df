#pragma once

#include <outlier_rejection.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "modules/core/pose_graph.hpp"
#include "runtime/dds/codec.hpp"

namespace km {

/// Largest number of closures in a message; a message that claims more is refused.
inline constexpr std::size_t kMaxInliers = 1U << 16U;

/// Only robot `a` may write the set of a pair. The closures are between `a` and `b` and ascend.
template <>
struct Codec<InlierSet> {
  using Wire = km_wire_InlierSet;
  static constexpr const char* kTopic = "inlier_sets";
  static constexpr std::uint16_t kVersion = 1;
  static constexpr std::size_t kMaxBytes = 64 + 12 * kMaxInliers;
  static const dds_topic_descriptor_t& descriptor() { return km_wire_InlierSet_desc; }

  struct Encoded {
    Wire wire{};
    std::vector<km_wire_ClosureRef> closures;
  };
  static MessageKey key_of(const InlierSet& set);
  static Encoded encode(const InlierSet& set);
  static Decoded<InlierSet> decode(const Wire& wire, const TeamPeer& writer);
};

}  // namespace km
